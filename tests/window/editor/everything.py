"""Scene texts that together have every kind of element, in the layout of files written by hand."""

from tests.toml_text import toml

EVERYTHING = """#:schema ../scene.schema.json
# every kind of element
title = "Everything"
[world]
gravity = [0.0, -9.81]
duration = 2.0

[[wall]]
name = "lane"
points = [[-8, 0], [-7, -1.0], [-6, 0]]  # open
thickness = 0.1
material = "wood"
[[ball]]
name = '7 "b"'
position = [ 2.0, 3.0 ] # m
radius = 5e-1
material = "steel"
""" + "".join(
    [
        toml("material", name="wood", friction=0.4),
        toml("material", name="steel"),
        toml("pair", between=["wood", "steel"], friction=0.1),
        toml("plane", name="ground", point=[0, -5], normal=[0.0, 1.0]),
        toml("wall", points=[[-8, 3], [-7, 3], [-7.5, 4]], closed=True, one_way=False),
        toml("post", position=[-5.0, 1.0], radius=0.2),
        toml("zone", name="round", position=[-5.0, 3.0], radius=0.4, gravity=[1.0, 1.0]),
        toml("zone", points=[[-9, 5], [-8, 5], [-8, 6]], to_layer="ramp"),
        toml("zone", points=[[-9, 7], [-8, 7], [-8, 8]], thickness=0.3, layers=["ramp"]),
        toml("zone", name="pool", points=[[-9, -4], [-8, -4], [-8, -3], [-9, -3]], liquid={"density": 2.0}),
        toml("sensor", name="gate", points=[[-9, 9], [-8, 9], [-8.3, 9.5], [-8, 10]], colour="#ff0000"),
        toml("sensor", name="feet", body="ship", points=[[-0.4, -0.6], [0.4, -0.6]], thickness=0.2),
        toml("sensor", body="g-2", position=[0.5, 0.0], radius=0.3),
        toml("ball", name="a", position=[0.0, 3.0], radius=0.5),
        toml("ball", position=[4.0, 3.0], radius=0.5),
        toml("box", name="c", position=[6.0, 3.0], size=[1, 1], angle=0.3),
        toml("box", name="anchor", position=[6.0, 5.0], size=[1, 1], fixed=True),
        toml("capsule", name="bat", position=[8.0, 3.0], length=1.0, radius=0.1),
        toml("capsule", name="pin", position=[8.0, 5.0], length=0.5, radius=0.1, angle=1.5),
        toml("polygon", name="tri", position=[8.0, 7.0], points=[[0, 0], [1, 0], [0, 1]]),
        toml("polygon", position=[6.0, 7.0], angle=0.5, points=[[0, 0], [1, 0], [1, 1], [0, 1]]),
        toml("body", name="ship", position=[4.0, 7.0], mass=1.0),
        toml("body.polygon", points=[[-0.5, -0.5], [0.5, -0.5], [0, 0.5]]),
        toml("body.ball", position=[0, 0.6], radius=0.2),
        toml("body.box", position=[0.0, -0.6], size=[0.3, 0.2], angle=0.2),
        toml("body.capsule", position=[0.5, 0.0], length=0.3, radius=0.1),
        toml("grid", name="g", origin=[-3, 5], columns=3, rows=2, spacing=[0.5, 0.5], radius=0.2),
        toml("scatter", lower=[-3, 7], upper=[0, 9], count=4, radius=0.2),
        toml("emitter", position=[1, 6], count=5, velocity_min=[-1, -1], velocity_max=[1, 1], lifetime=0.5),
        toml("stack", base=[-4.0, -4.0], columns=2, rows=3, size=[0.5, 0.5]),
        toml("rope", name="line", start=[0.0, 5.0], end=[2.0, 5.0], links=4, tie={"start": "a"}),
        toml("rope", start=[0.0, -1.0], end=[2.0, -1.0], links=3, kind="planks"),
        toml("cloth", corner=[2, 0], columns=3, rows=3, spacing=[0.4, 0.4], stiffness=90.0, bend=1.0),
        toml("ragdoll", position=[5.0, -1.0], height=1.8),
        toml("joint", name="rod", kind="rod", between=["a", "c"], length=6.0),
        toml("joint", kind="rod", between=["a"], anchors=[[0, 0], [0, 5]]),
        toml("joint", kind="pivot", between=["a", '7 "b"'], at=[1.0, 3.0]),
        toml("joint", kind="pivot", between=["c", "tri"], anchors=[[1.0, 2.0], [-1.0, -2.0]]),
        toml("joint", kind="pivot", between=["ship"], at=[4.0, 7.0]),
        toml("joint", kind="slide", between=["a", "ship"], least=0.5, most=9.0),
        toml("joint", kind="groove", between=["a", "c"], groove=[[0, 0], [1, 0]]),
        toml("joint", kind="groove", between=["tri"], groove=[[8, 7], [9, 7]]),
        toml("joint", kind="rotary_limit", between=["a", "c"], least=-1, most=1),
        toml("joint", kind="motor", between=["c"], rate=1.0),
        toml("joint", kind="gear", between=["a", "c"], ratio=2.0),
        toml("joint", kind="spring", between=["ball-3", "c"], anchors=[[0.1, 0], [0, 0.2]], stiffness=10.0),
        toml("joint", kind="rotary_spring", between=["a", "tri"], stiffness=10.0, max_force=3.0),
        toml("joint", kind="ratchet", between=["a", "tri"], ratchet=0.5, max_force=3.0, max_bias=1.0, bias=0.1),
        toml("joint", kind="weld", between=["a", "tri"], at=[1.0, 3.0], torque_strength=9.0),
        toml("joint", kind="prismatic", between=["a", "c"], axis=[0, 1], travel=[-1, 1], rate=1.0, max_force=9.0),
        toml("joint", kind="wheel", between=["c"], axis=[0, 1], at=[1, 3], travel=[-1, 1], stiffness=9.0, rate=1.0),
        toml("event", time=9.0, kind="explosion", position=[0, 1], radius=2.0, impulse=0.1),
        toml("event", time=9.0, kind="set", path="world.gravity", value=[0, -1]),
        toml("tyre", name="skid", body="ship", point=[0.0, -0.3], grip=5.0, drive=2.0, steer=0.3, keys=True),
        toml("thrust", name="engine", body="ship", force=[0.0, 5.0], point=[0.0, -0.3], key="up"),
        toml("drive", name="flip", kind="stroke", body="bat", pivot=[7.5, 3.0], stops=[0.0, 1.0], rate=1.0, key="left"),
        toml("drive", name="plunger", kind="plunger", body="pin", direction=[0, 1], travel=1.0, speed=1.0, key="space"),
    ]
)
ATTRACTED = "".join(
    [
        toml("ball", name="a", position=[0.0, 3.0], radius=0.5),
        toml("ball", name="b", position=[2.0, 3.0], radius=0.5),
        toml("joint", kind="pulley", between=["a", "b"], wheels=[[0.0, 9.0], [6.0, 9.0]]),
        toml("attraction", toward=[0.0, 3.0], strength=1.0),
        toml("attraction", toward="a", strength=1.0),
    ]
)
TABLE = """title = "Table"
world = { gravity = [0.0, 0.0] }
surface = { sliding_friction = 0.2, rolling_friction = 0.01 }

""" + "".join(
    [
        toml("ball", name="cue", position=[-0.5, 0.0], radius=0.03),
        toml("ball", position=[0.5, 0.0], radius=0.03),
        toml("pocket", position=[1.1, 0.6], radius=0.06),
        toml("wall", points=[[-1.2, -0.7], [1.2, -0.7], [1.2, 0.7], [-1.2, 0.7]], closed=True, height=0.04),
        toml("shot", ball="cue", speed=1.0, aim=0.1),
    ]
)
