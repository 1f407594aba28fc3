"""CommonRoad scenarios of known content."""

import numpy as np

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
    """One lane that turns left by an angle within 200 m, and a vehicle on it."""
    radius = 200.0 / np.radians(degrees)

    def arc(at: np.ndarray, left: float) -> np.ndarray:
        angle = at / radius
        return np.stack([(radius - left) * np.sin(angle), radius - (radius - left) * np.cos(angle)], axis=-1)

    def bound(left: float) -> str:
        return "".join(f"<point><x>{x:.4f}</x><y>{y:.4f}</y></point>" for x, y in arc(np.linspace(0, 200, 60), left))

    lane = f'<lanelet id="1"><leftBound>{bound(0.0)}</leftBound><rightBound>{bound(-3.5)}</rightBound></lanelet>'
    return scenario(lane, driving(100, 20.0, -1.75, 20.0, 20))
