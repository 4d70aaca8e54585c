"""Compare the car of `games/racing_car` with that of Gymnasium's CarRacing, and write the cases of the tests.

    PYTHON-WITH-BOX2D -m tools.oracles.racing_car [--write]

Gymnasium's car is an independent simulation of the same tyres, in Box2D 2.3, with wheels that are bodies and have a
spin of their own. It is driven without a track and pictures; `Box2D` and `gymnasium` have to be installed. It runs

- *as it is*, in steps of 1/50 s, with wheels of 1.6 kg·m²: seen from the car, 5.5 kg each, three times its own mass
  together;
- with *light wheels*, of a hundredth of that, in steps of 0.2 ms, as its explicit friction then needs.

Each manoeuvre is a list of throttle, brake and steering over time. The angles to which the joints of its front wheels
turn are the steering of the tyres here. `--write` stores the paths of the car with light wheels as
`tests/laws/cases/racing_car.json`.
"""

import argparse
import json
import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import sandbox
from sandbox.action import Action, Steer
from sandbox.arrays import FloatArray
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.document import to_document
from sandbox.scene.files.load import from_document
from sandbox.scene.files.shipped_scenes import find

CASES = Path(__file__).resolve().parents[2] / "tests" / "laws" / "cases" / "racing_car.json"

FRAME = 0.02
"""s, between two inputs"""
LIGHT = 100.0
"""Factor by which wheels are lighter, and steps shorter"""
FRONT = ("front left", "front right")
MAX_STEER = 0.4
"""rad"""
MAX_DRIVE = 1000.0
"""N, more than the grip"""
ROUND = 4
"""decimal places of the stored figures"""


class Road:
    """Tile of the road; without any a wheel is on grass, with 0.6 of the grip."""

    road_friction = 1.0


class Manoeuvre(NamedTuple):
    """Inputs of a drive along a straight, from a speed."""

    name: str
    speed: float
    """m/s, at the start"""
    duration: float
    """s"""
    throttle: float = 0.0
    steer: float = 0.0
    """rad, to the left"""
    brake_from: float = math.inf
    """s, from which on the brakes lock"""


MANOEUVRES = (
    Manoeuvre("full throttle", 0.0, 0.8, throttle=1.0),
    Manoeuvre("braking", 60.0, 0.5, brake_from=0.0),
    Manoeuvre("turning circle", 10.0, 2.0, steer=0.3),
    Manoeuvre("fast bend", 50.0, 1.0, steer=0.2),
    Manoeuvre("too fast a bend", 80.0, 1.5, steer=0.4),
    Manoeuvre("braking in a bend", 50.0, 1.0, steer=0.3, brake_from=0.3),
    Manoeuvre("throttle in a bend", 20.0, 1.5, throttle=0.15, steer=0.2),
    Manoeuvre("full throttle in a bend", 20.0, 1.0, throttle=1.0, steer=0.2),
)


class Drive(NamedTuple):
    """States of a car after each frame: the start is at the origin, along x."""

    path: FloatArray
    """(F + 1, 3) position of the centre of mass, m, and angle, rad"""
    velocity: FloatArray
    """(F + 1, 2) m/s"""
    inputs: FloatArray
    """(F, 3) means in each frame: angle of the front wheels, rad, force on each rear wheel by the engine, N, brake"""


def gymnasium_drive(manoeuvre: Manoeuvre, lightness: float) -> Drive:
    """Drive Gymnasium's car, with wheels and steps divided by a factor."""
    import Box2D
    from gymnasium.envs.box2d import car_dynamics

    inertia = car_dynamics.WHEEL_MOMENT_OF_INERTIA
    car_dynamics.WHEEL_MOMENT_OF_INERTIA = inertia / lightness
    world, steps = Box2D.b2World((0, 0)), round(lightness)
    car = car_dynamics.Car(world, 0.0, 0.0, 0.0)
    for body in (car.hull, *car.wheels):
        body.linearVelocity = (0.0, manoeuvre.speed)
    for wheel in car.wheels:
        wheel.omega = manoeuvre.speed / wheel.wheel_rad
        wheel.tiles.add(Road())
    states, inputs = [_state(car)], []
    try:
        for k in range(round(manoeuvre.duration / FRAME)):
            brake = 1.0 if k * FRAME >= manoeuvre.brake_from else 0.0
            angles, forces = [], []
            for _ in range(steps):
                car.steer(manoeuvre.steer)
                for wheel in car.wheels[2:4]:
                    wheel.gas = manoeuvre.throttle  # at once: `gas` raises it by 0.1 a step, whatever the step
                car.brake(brake)
                angles.append(np.mean([wheel.joint.angle for wheel in car.wheels[:2]]))
                forces += [_engine_force(wheel) for wheel in car.wheels[2:4]]
                car.step(FRAME / steps)
                world.Step(FRAME / steps, 6 * 30, 2 * 30)
            states.append(_state(car))
            inputs.append((float(np.mean(angles)), float(np.mean(forces)), brake))
    finally:
        car_dynamics.WHEEL_MOMENT_OF_INERTIA = inertia
    table = np.asarray(states)
    table[:, :2] -= table[0, :2]
    return Drive(table[:, :3], table[:, 3:], np.asarray(inputs))


def _engine_force(wheel: Any) -> float:
    """Return the force that the power of the engine is on a wheel of its present spin, N."""
    from gymnasium.envs.box2d import car_dynamics

    return float(car_dynamics.ENGINE_POWER * wheel.gas / (abs(wheel.omega) + 5.0) / wheel.wheel_rad)


def _state(car: Any) -> tuple[float, ...]:
    """Return the centre of mass, the angle, and its velocity, turned so that the car starts along x."""
    bodies = (car.hull, *car.wheels)
    mass = sum(body.mass for body in bodies)
    x, y = (sum(body.mass * body.worldCenter[k] for body in bodies) / mass for k in (0, 1))
    vx, vy = (sum(body.mass * body.linearVelocity[k] for body in bodies) / mass for k in (0, 1))
    return y, -x, car.hull.angle, vy, -vx


def mass_properties() -> tuple[float, float, float]:
    """Return mass, kg, moment of inertia about the centre of mass, kg·m², and how far that is in front, m."""
    import Box2D
    from gymnasium.envs.box2d import car_dynamics

    car = car_dynamics.Car(Box2D.b2World((0, 0)), 0.0, 0.0, 0.0)
    bodies = (car.hull, *car.wheels)
    mass = sum(body.mass for body in bodies)
    front = sum(body.mass * body.worldCenter[1] for body in bodies) / mass
    about_centres = [(body.inertia - body.mass * body.localCenter.lengthSquared) for body in bodies]
    arms = [body.mass * (body.worldCenter[0] ** 2 + (body.worldCenter[1] - front) ** 2) for body in bodies]
    return mass, sum(about_centres) + sum(arms), front


def car_alone(speed: float, duration: float, dt: float) -> Scene:
    """Return the car of the scene at a speed on an endless plain, without rolling drag and the drag of the air."""
    document = to_document(sandbox.load(find("games/racing_car")))
    (car,) = (body for body in document["body"] if body["name"] == "car")
    tyres = [tyre for tyre in document["tyre"] if tyre["body"] == "car"]
    for tyre in tyres:
        del tyre["rolling_drag"]
        if "drive" in tyre:
            tyre["drive"] = MAX_DRIVE
    centre = car["centre_of_mass"]
    car |= {"position": [-centre[0], -centre[1]], "velocity": [speed, 0.0]}
    del car["material"]
    world = {"gravity": [0.0, 0.0], "duration": duration}
    return from_document({"world": world, "solver": {"dt": dt}, "body": [car], "tyre": tyres})


def steering_actions(scene: Scene, inputs: FloatArray) -> tuple[Action, ...]:
    """Return the actions by which the car is driven with the inputs (F, 3) of each frame, as in `Drive`."""
    actions = list[Action]()
    for k, (angle, force, brake) in enumerate(inputs.tolist()):
        for tyre in scene.tyres:
            steer = min(angle / MAX_STEER, 1.0) if tyre.name in FRONT else 0.0
            throttle = min(force / MAX_DRIVE, 1.0)
            actions.append(Steer(time=k * FRAME, tyre=str(tyre.name), throttle=throttle, brake=brake, steer=steer))
    return tuple(actions)


def drive_here(manoeuvre: Manoeuvre, inputs: FloatArray, engine: str, dt: float) -> Drive:
    """Drive the car of the scene by the inputs (F, 3) of each frame."""
    scene = car_alone(manoeuvre.speed, len(inputs) * FRAME, dt)
    run = sandbox.run(scene, engine, actions=steering_actions(scene, inputs), audit=False)
    rows = np.searchsorted(run.time, np.arange(len(inputs) + 1) * FRAME - 1e-9)
    path = np.column_stack((run.position[rows, 0], run.angle[rows, 0]))
    return Drive(path, run.velocity[rows, 0], inputs)


def deviation(one: Drive, other: Drive) -> tuple[float, float]:
    """Return the largest distance of two drives, m, and their distance at the end as a fraction of the way."""
    distance = np.hypot(*(one.path - other.path)[:, :2].T)
    way = np.hypot(*np.diff(one.path[:, :2], axis=0).T).sum()
    return float(distance.max()), float(distance[-1] / way)


def main() -> None:
    """Print the comparison, and write the cases."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", action="store_true", help="write the cases of the tests")
    parser.add_argument("--engine", default="pymunk")
    parser.add_argument("--dt", type=float, default=1e-3, help="s, of the runs here")
    arguments = parser.parse_args()
    car = sandbox.load(find("games/racing_car")).compounds[0]
    here = car.mass, car.moment, None if car.centre_of_mass is None else car.centre_of_mass[0]
    print("mass, moment, centre of mass: there", *(f"{each:.5g}" for each in mass_properties()), "here", *here)
    headings = "manoeuvre", "way", "here and light wheels", "end", "light and heavy wheels", "end with heavy wheels"
    print(f"| {' | '.join(headings)} |")
    print("|---|---|---|---|---|---|")
    cases = []
    for manoeuvre in MANOEUVRES:
        light, heavy = gymnasium_drive(manoeuvre, LIGHT), gymnasium_drive(manoeuvre, 1.0)
        own = drive_here(manoeuvre, light.inputs, arguments.engine, arguments.dt)
        way = np.hypot(*np.diff(light.path[:, :2], axis=0).T).sum()
        (apart, _), (changed, _) = deviation(light, own), deviation(light, heavy)
        speeds = [math.hypot(*each.velocity[-1]) for each in (own, light, heavy)]
        print(
            f"| {manoeuvre.name} | {way:.1f} m | {apart:.2f} m | {speeds[0]:.1f} and {speeds[1]:.1f} m/s "
            f"| {changed:.1f} m | {speeds[2]:.1f} m/s |"
        )
        table = {"name": manoeuvre.name, "speed": manoeuvre.speed}
        for key, values in (("inputs", light.inputs), ("path", light.path), ("velocity", light.velocity)):
            table[key] = np.round(values, ROUND).tolist()
        cases.append(table)
    if arguments.write:
        CASES.parent.mkdir(exist_ok=True)
        CASES.write_text("[\n" + ",\n".join(json.dumps(each, separators=(",", ":")) for each in cases) + "\n]\n")


if __name__ == "__main__":
    main()
