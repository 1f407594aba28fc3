"""Recordings of known content: own tables, NGSIM in feet and in metres, CommonRoad scenarios."""

import numpy as np
import polars as pl

from coverdrive.recordings.recording import SCHEMA

FOOT = 0.3048
COLUMNS = [
    "Vehicle_ID",
    "Frame_ID",
    "Total_Frames",
    "Global_Time",
    "Local_X",
    "Local_Y",
    "Global_X",
    "Global_Y",
    "v_length",
    "v_Width",
    "v_Class",
    "v_Vel",
    "v_Acc",
    "Lane_ID",
    "O_Zone",
    "D_Zone",
    "Int_ID",
    "Section_ID",
    "Direction",
    "Movement",
    "Preceding",
    "Following",
    "Space_Headway",
    "Time_Headway",
    "Location",
]
TEXT_COLUMNS = COLUMNS[:14] + COLUMNS[20:24]


def ngsim_table(
    vehicles: int = 6,
    seconds: float = 10.0,
    speed: float = 15.0,
    location: str = "us-101",
    start: int = 1_118_846_980_200,
    first_frame: int = 10,
) -> pl.DataFrame:
    """Vehicles at constant speed [m/s], side by side in three lanes of 12 ft, as the portal writes them (feet)."""
    rows = round(seconds * 10)
    vehicle = np.repeat(np.arange(1, vehicles + 1), rows)
    frame = np.tile(np.arange(rows), vehicles)
    lane = (vehicle - 1) % 3 + 1
    columns: dict[str, object] = dict.fromkeys(COLUMNS)
    columns |= {
        "Vehicle_ID": vehicle,
        "Frame_ID": first_frame + frame,
        "Total_Frames": np.full(len(vehicle), rows),
        "Global_Time": start + 100 * frame,
        "Local_X": np.round(12.0 * lane - 6.0, 3),
        "Local_Y": np.round((50.0 * vehicle + speed * frame / 10) / FOOT, 3),
        "v_length": np.full(len(vehicle), 15.0),
        "v_Width": np.full(len(vehicle), 6.0),
        "v_Class": np.full(len(vehicle), 2),
        "v_Vel": np.full(len(vehicle), round(speed / FOOT, 2)),
        "v_Acc": np.zeros(len(vehicle)),
        "Lane_ID": lane,
        "Preceding": np.zeros(len(vehicle), dtype=int),
        "Following": np.zeros(len(vehicle), dtype=int),
        "Space_Headway": np.zeros(len(vehicle)),
        "Time_Headway": np.zeros(len(vehicle)),
        "Location": location,
    }
    return pl.DataFrame(columns)


def traffic(vehicles: int = 6, seconds: float = 10.0, dt: float = 0.1) -> pl.DataFrame:
    """Vehicles at 22 m/s in three lanes; vehicle 1 moves to the left at 0.2 m/s."""
    moment = np.tile(np.arange(round(seconds / dt)), vehicles)
    vehicle = np.repeat(np.arange(vehicles), round(seconds / dt))
    drift = np.where(vehicle == 1, 0.2, 0.0)
    columns = {
        "vehicle": vehicle,
        "group": 0 * vehicle,
        "time": moment * dt,
        "lon": 40.0 * vehicle + 22.0 * moment * dt,
        "lat": 1.8 + 3.6 * (vehicle % 3) + drift * moment * dt,
        "speed": np.hypot(22.0, drift),
        "heading": np.arctan2(drift, 22.0),
        "length": 4.6,
        "width": 1.9,
    }
    return pl.DataFrame(columns, schema=SCHEMA)


def metric(**columns: pl.Expr) -> pl.DataFrame:
    moment, vehicle = np.tile(np.arange(60), 3), np.repeat([1, 2, 3], 60)
    return pl.DataFrame(
        {
            "Vehicle_ID": vehicle,
            "Frame_ID": moment,
            "Global_Time": 1_118_846_980_200 + 100 * moment,
            "local_x_m": 1.8 + 3.6 * (vehicle - 1),
            "local_y_m": 20.0 * vehicle + 1.5 * moment,
            "v_vel_mps": 15.0,
        }
    ).with_columns(**columns)


RADIUS, TURN = 1500.0, 0.7
"""A bend to the left of 180 m, the whole map turned"""


def on_map(at: np.ndarray, left: float) -> np.ndarray:
    """Map coordinates at a distance [m] along the road's left edge and an offset [m] to the left of it."""
    bend = at / RADIUS
    x, y = (RADIUS - left) * np.sin(bend), RADIUS - (RADIUS - left) * np.cos(bend)
    return np.stack([x * np.cos(TURN) - y * np.sin(TURN), x * np.sin(TURN) + y * np.cos(TURN)], axis=-1)


def points(at: np.ndarray, left: float) -> str:
    return "".join(f"<point><x>{x:.4f}</x><y>{y:.4f}</y></point>" for x, y in on_map(at, left))


def lanelet(number: int, start: float, end: float, left: float, width: float, links: str) -> str:
    at = np.linspace(start, end, 30)
    return (
        f'<lanelet id="{number}"><leftBound>{points(at, left)}</leftBound>'
        f"<rightBound>{points(at, left - width)}</rightBound>{links}</lanelet>"
    )


def state(at: float, left: float, speed: float, moment: int, tag: str = "state") -> str:
    x, y = on_map(np.array([at]), left)[0]
    return (
        f"<{tag}><time><exact>{moment}</exact></time>"
        f"<position><point><x>{x:.5f}</x><y>{y:.5f}</y></point></position>"
        f"<orientation><exact>{TURN + at / RADIUS:.4f}</exact></orientation>"
        f"<velocity><exact>{speed}</exact></velocity></{tag}>"
    )


def vehicle(number: int, states: list[str]) -> str:
    following = f"<trajectory>{''.join(states[1:])}</trajectory>" if len(states) > 1 else ""
    return (
        f'<dynamicObstacle id="{number}"><type>car</type><shape><rectangle><length>4.6</length>'
        f"<width>1.9</width></rectangle></shape>{states[0]}{following}</dynamicObstacle>"
    )


def scenario(lanelets: str, vehicles: str) -> str:
    return (
        '<?xml version="1.0" encoding="utf-8"?><commonRoad commonRoadVersion="2020a" benchmarkID="USA_Test-1_1_T-1" '
        'date="2020-01-01" author="a" affiliation="b" source="c" timeStepSize="0.1"><location><geoNameId>1</geoNameId>'
        "<gpsLatitude>0</gpsLatitude><gpsLongitude>0</gpsLongitude></location><scenarioTags><highway/></scenarioTags>"
        f"{lanelets}{vehicles}</commonRoad>"
    )


def three_lanes() -> str:
    """Lanes 3.5, 3.5 and 4 m wide, each of two lanelets; beside the last 40 m runs a ramp."""
    found, left = "", 0.0
    for lane, width in enumerate((3.5, 3.5, 4.0)):
        for part, (start, end) in enumerate(((0.0, 110.0), (110.0, 180.0))):
            number = 10 * (lane + 1) + part
            links = f'<predecessor ref="{number - 1}"/>' if part else f'<successor ref="{number + 1}"/>'
            if lane > 0:
                links += f'<adjacentLeft ref="{number - 10}" drivingDir="same"/>'
            if lane < 2:
                links += f'<adjacentRight ref="{number + 10}" drivingDir="same"/>'
            found += lanelet(number, start, end, left, width, links)
        left -= width
    return found + lanelet(90, 140.0, 180.0, left - 2.0, 3.5, "")


def driving(number: int, start: float, left: float, speed: float, count: int) -> str:
    states = [
        state(start + speed * moment / 10, left, speed, moment, "initialState" if moment == 0 else "state")
        for moment in range(count)
    ]
    return vehicle(number, states)


def straight() -> str:
    """Three lanes that bend by 7°, and two vehicles on them."""
    return scenario(three_lanes(), driving(100, 20.0, -1.75, 20.0, 40) + driving(101, 60.0, -9.0, 10.0, 30))


def bent(degrees: float) -> str:
    """One lane that turns left by an angle within 200 m, and a vehicle at 20 m/s in its middle."""
    radius = 200.0 / np.radians(degrees)

    def arc(at: np.ndarray, left: float) -> np.ndarray:
        angle = at / radius
        return np.stack([(radius - left) * np.sin(angle), radius - (radius - left) * np.cos(angle)], axis=-1)

    def bound(left: float) -> str:
        return "".join(f"<point><x>{x:.4f}</x><y>{y:.4f}</y></point>" for x, y in arc(np.linspace(0, 200, 60), left))

    lane = f'<lanelet id="1"><leftBound>{bound(0.0)}</leftBound><rightBound>{bound(-3.5)}</rightBound></lanelet>'
    states = list[str]()
    for moment, at in enumerate(np.linspace(20, 180, round(160 * (1 + 1.75 / radius) / 2) + 1)):
        tag, (x, y) = "state" if moment else "initialState", arc(at, -1.75)
        states.append(
            f"<{tag}><time><exact>{moment}</exact></time>"
            f"<position><point><x>{x:.5f}</x><y>{y:.5f}</y></point></position>"
            f"<orientation><exact>{at / radius:.4f}</exact></orientation>"
            f"<velocity><exact>20.0</exact></velocity></{tag}>"
        )
    return scenario(lane, vehicle(100, states))
