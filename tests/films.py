"""Readers of gif and mp4 files: pixels of each frame and its duration."""

import re
import subprocess
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import numpy.typing as npt
from PIL import Image

Pictures = list[npt.NDArray[np.int64]]


def gif_frames(path: Path) -> tuple[Pictures, list[int]]:
    """Return each composed frame of a gif, (H, W, 3), and its duration, ms."""
    with Image.open(path) as image:
        frames, durations = [], []
        for k in range(image.n_frames):
            image.seek(k)
            frames.append(np.asarray(image.convert("RGB")).astype(np.int64))
            durations.append(image.info["duration"])
    return frames, durations


def mp4_frames(path: Path) -> tuple[Pictures, str]:
    """Return each frame of an mp4, (H, W, 3), and ffmpeg's description of the file."""
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-i", str(path), "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    done = subprocess.run(command, capture_output=True, check=True, timeout=60)
    description = done.stderr.decode()
    size = re.search(r"Video: .*?, (\d+)x(\d+)", description)
    assert size is not None
    pictures = np.frombuffer(done.stdout, np.uint8).reshape(-1, int(size[2]), int(size[1]), 3)
    return list(pictures.astype(np.int64)), description
