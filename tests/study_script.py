"""A study as a user writes one: the spread of drops behind rows of posts, by engine. Its argument is a folder."""

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt

import sandbox

ENGINES = ["pymunk", "reference", "exact"]


def board(restitution: float) -> sandbox.Scene:
    """Return a ball above two rows of posts."""
    places = [[0.3 * k - 0.9, 0.6 - 0.2 * (k % 2)] for k in range(7)]
    return sandbox.Scene(
        world=sandbox.World(gravity=[0.0, -9.81], duration=0.5),
        solver=sandbox.Settings(dt=0.005),
        materials=[sandbox.Material(name="steel", restitution=restitution)],
        planes=[sandbox.Plane(name="ground", point=[0.0, 0.0], normal=[0.0, 1.0], material="steel")],
        walls=[sandbox.Wall(points=[[-2.0, 0.0], [-2.0, 2.0]])],
        posts=[sandbox.Post(name=f"post {k}", position=place, radius=0.05) for k, place in enumerate(places)],
        balls=[sandbox.Ball(name="drop", position=[0.01, 1.5], radius=0.04, material="steel")],
    )


def spread(scene: sandbox.Scene, engine: str) -> float:
    """Return the standard deviation of the final x, m."""
    ends: sandbox.Ensemble = sandbox.ensemble(scene, 20, vary={"ball.drop.position": 0.01}, engine=engine, dt=0.01)
    x: npt.NDArray[np.float64] = ends.position[:, 0, 0]
    return float(x.std())


def rows(comparison: sandbox.Comparison) -> Iterator[tuple[str, float]]:
    """Yield the engine and the largest error, m, of the rows with a score."""
    for row in comparison.rows:
        score: sandbox.Score = row.score
        if score.max_position is not None:
            yield row.engine, score.max_position


def main(folder: Path) -> None:
    """Print the errors of the engines, a recommendation, and what a store has."""
    scene = board(0.6)
    changes: sandbox.SettingsChanges = {"dt": 0.005, "substeps": 2}
    for engine, error in rows(sandbox.compare(scene, ENGINES, **changes)):
        print(f"{engine:10} error {error:.0e} m, spread {spread(scene, engine):.3f} m")
    found: sandbox.Tradeoff = sandbox.tradeoff(scene, ["pymunk"], tolerance=0.05, most=2, repeats=1, dt=0.005)
    points: tuple[sandbox.Evaluation, ...] = found.points
    print(len(points), "settings")
    with sandbox.Store(folder) as store:
        for substeps in (1, 2):
            run = sandbox.run(scene, engine="reference", dt=0.005, substeps=substeps, integrator="rk4", strict=True)
            stored: sandbox.StoredRun = store.add_run(run, f"{substeps:020x}")
            print(stored.status, run.position[-1, run.number("drop"), 1] > 0.0)
    with sandbox.open_store(folder) as runs:
        statuses: npt.NDArray[np.str_] = runs.table(kind="numpy")["status"]
        print(len(statuses), "runs", runs.statuses())


if __name__ == "__main__":
    main(Path(sys.argv[1]))
