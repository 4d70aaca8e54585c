"""Reading films back: what each picture shows, and how long."""

import re
import subprocess
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import numpy.typing as npt
from PIL import Image

Pictures = list[npt.NDArray[np.int64]]


def gif_frames(path: Path) -> tuple[Pictures, list[int]]:
    """Return each picture of a gif as it is seen, (H, W, 3), and how long, ms."""
    with Image.open(path) as image:
        seen, shown = [], []
        for k in range(image.n_frames):
            image.seek(k)
            seen.append(np.asarray(image.convert("RGB")).astype(np.int64))
            shown.append(image.info["duration"])
    return seen, shown


def mp4_frames(path: Path) -> tuple[Pictures, str]:
    """Return each picture of an mp4, (H, W, 3), and what ffmpeg says of it."""
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-i", str(path), "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    done = subprocess.run(command, capture_output=True, check=True, timeout=60)
    about = done.stderr.decode()
    size = re.search(r"Video: .*?, (\d+)x(\d+)", about)
    assert size is not None
    pictures = np.frombuffer(done.stdout, np.uint8).reshape(-1, int(size[2]), int(size[1]), 3)
    return list(pictures.astype(np.int64)), about
