"""Colours: reducing pictures to a palette, the same colour always to the same entry.

Colours are told apart by the upper six bits of each channel, a cell. A palette has the commonest cells' colours as
they are, and the rest from a median cut in which rare colours count for more than their share: the flat areas of a
drawing are few and large, its accents small.
"""

import numpy as np
import numpy.typing as npt
from PIL import Image

CELLS = 1 << 18
AS_THEY_ARE = 96
"""Entries of the commonest colours."""
FAR = 20.0
"""of 255: a colour so far from its entry is shown badly"""
MANY = 3e-4
"""Share of a picture's pixels that may be shown badly before the palette is renewed."""
FADING = 0.5
"""What colours of before count when a palette is renewed."""
AT_ONCE = 4096
"""Cells whose distances to all entries are worked on at once: 12 MB."""

Index = npt.NDArray[np.uint8]
Cells = npt.NDArray[np.int32]


class Colours:
    """A palette that lasts, and is renewed where it must be.

    Args:
        most: entries it may have, of at most 256.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._palette = np.zeros((0, 3))
        self._entry = np.full(CELLS, -1, np.int16)
        self._error = np.zeros(CELLS)
        self._colour = np.zeros((CELLS, 3))
        self._known = np.zeros(CELLS, np.bool_)
        self._weight = np.zeros(CELLS)
        self._tolerated = MANY

    @property
    def table(self) -> bytes:
        """The palette as 256 times red, green, blue."""
        entries = np.zeros((256, 3), np.uint8)
        entries[: len(self._palette)] = np.round(self._palette)
        return entries.tobytes()

    def reduce(self, picture: npt.NDArray[np.uint8]) -> tuple[Cells, Index, bool]:
        """Reduce a picture (H, W, 3).

        Returns:
            Each pixel's cell (H, W), each pixel's entry (H, W), and whether the palette was renewed for it.
        """
        red, green, blue = (picture[..., k].astype(np.int32) >> 2 for k in range(3))
        cells = np.asarray(red << 12 | green << 6 | blue)
        counts = np.bincount(cells.ravel(), minlength=CELLS)
        used = np.flatnonzero(counts)
        if not self._known[used].all():
            self._learn(cells, picture, counts, used)
        self._weight[used] += counts[used]
        self._assign(used)
        bad = self._bad(used, counts)
        renewed = not len(self._palette) or bad > self._tolerated
        if renewed:
            self._renew()
            self._assign(used)
            # More colours than a palette holds: renewing it for every picture would make them flicker.
            self._tolerated = max(MANY, 2.0 * self._bad(used, counts))
        return cells, self._entry[cells].astype(np.uint8), renewed

    def _learn(
        self,
        cells: Cells,
        picture: npt.NDArray[np.uint8],
        counts: npt.NDArray[np.int64],
        used: npt.NDArray[np.int64],
    ) -> None:
        """Note the mean colour of each cell that is met for the first time."""
        new = used[~self._known[used]]
        for k in range(3):
            total = np.bincount(cells.ravel(), weights=picture[..., k].ravel(), minlength=CELLS)
            self._colour[new, k] = total[new] / counts[new]
        self._known[new] = True

    def _assign(self, used: npt.NDArray[np.int64]) -> None:
        """Give each cell that has none its nearest entry."""
        if not len(self._palette):
            return
        new = used[self._entry[used] < 0]
        for begin in range(0, len(new), AT_ONCE):
            some = new[begin : begin + AT_ONCE]
            away = np.square(self._colour[some, None] - self._palette).sum(axis=2)
            nearest = away.argmin(axis=1)
            self._entry[some] = nearest
            self._error[some] = np.sqrt(away[np.arange(len(some)), nearest])

    def _bad(self, used: npt.NDArray[np.int64], counts: npt.NDArray[np.int64]) -> float:
        """Return the share of pixels that are shown badly."""
        return float(counts[used][self._error[used] > FAR].sum() / counts.sum())

    def _renew(self) -> None:
        """Choose a palette for all colours seen, the recent ones above all."""
        seen = np.flatnonzero(self._weight > 0.5)
        seen = seen[np.argsort(-self._weight[seen], kind="stable")]
        first, rest = seen[: self._most], seen[self._most :]
        if len(rest):
            first, rest = seen[:AS_THEY_ARE], seen[AS_THEY_ARE:]
        palette = np.round(self._colour[first])
        if len(rest):
            palette = np.concatenate((palette, self._cut(rest, self._most - AS_THEY_ARE)))
        self._palette = palette
        self._entry[:] = -1
        self._error[:] = 0.0
        self._weight *= FADING

    def _cut(self, cells: npt.NDArray[np.int64], most: int) -> npt.NDArray[np.float64]:
        """Return at most so many colours (K, 3) by median cut, each cell counting by the logarithm of its pixels."""
        times = 1 + np.log2(1.0 + self._weight[cells]).astype(np.int64)
        row = np.repeat(np.round(self._colour[cells]).astype(np.uint8), times, axis=0)
        image = Image.fromarray(row[None]).quantize(most, Image.Quantize.MEDIANCUT)
        return np.asarray(image.getpalette()[: 3 * most], np.float64).reshape(-1, 3)  # type: ignore[index]  # it has one
