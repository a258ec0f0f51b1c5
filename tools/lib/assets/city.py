"""The city: blocks, lots, and the kinds of building on them."""

import math
from dataclasses import dataclass

from .building import Tier, building
from .plane import chamfered, inset, rectangle, regular


class Random:
    """splitmix64 (Steele, Lea and Flood 2014): the same numbers in every version of Python."""

    MASK = (1 << 64) - 1

    def __init__(self, seed):
        self.state = seed

    def unit(self):
        """Uniform in [0, 1)."""
        self.state = (self.state + 0x9E3779B97F4A7C15) & self.MASK
        z = self.state
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & self.MASK
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & self.MASK
        return ((z ^ (z >> 31)) >> 11) / (1 << 53)

    def between(self, low, high):
        """Uniform in [low, high)."""
        return low + (high - low) * self.unit()

    def pick(self, options):
        """One of several."""
        return options[int(self.unit() * len(options))]


@dataclass
class Lot:
    """A building's ground rectangle, metres."""

    x0: float
    z0: float
    x1: float
    z1: float

    def plan(self):
        """Its outline."""
        return rectangle(self.x0, self.z0, self.x1, self.z1)

    def centre(self):
        """Its middle, (x, z)."""
        return ((self.x0 + self.x1) / 2, (self.z0 + self.z1) / 2)

    def size(self):
        """Width along x and along z."""
        return (self.x1 - self.x0, self.z1 - self.z0)


SEED = 20130719

CITY_X = (16.0, 24.6)
CITY_Z = (0.4, 14.6)
HEIGHTS = (1.0, 6.5)
FOOTPRINTS = (0.8, 1.8)
ALLEY = 0.26
CROSS_STREET = 0.6

# Blocks and the streets between them: across the wave's path (along z), then in its path (along x).
BLOCKS_X = [(16.0, 18.3), (18.9, 21.5), (22.1, 24.6)]
BLOCKS_Z = [(0.4, 3.05), (3.95, 6.85), (8.0, 10.95), (11.85, 14.6)]

# Places of the landmarks: (block along x, block along z, lot within the block) -> kind.
LANDMARKS = {
    (2, 1, 2): "spire_tower",
    (2, 2, 3): "drum_tower",
    (1, 2, 0): "tapered_tower",
    (2, 0, 3): "octagon_tower",
    (1, 0, 1): "drum_tower",
    (0, 1, 1): "chapel",
    (2, 3, 2): "stepped_tower",
}
# Lots left open as small squares.
SQUARES = {(0, 2, 0), (1, 3, 1)}


def lots(random):
    """Every lot with its place: (block along x, block along z, number), Lot."""
    for i, (bx0, bx1) in enumerate(BLOCKS_X):
        for j, (bz0, bz1) in enumerate(BLOCKS_Z):
            rows = split(random, bx0, bx1, 2)
            # A block of three narrow lots now and then, where the width allows it.
            narrow = bz1 - bz0 >= 3 * FOOTPRINTS[0] + 2 * ALLEY and (i + j) % 2 == 0
            number = 0
            for x0, x1 in rows:
                for z0, z1 in split(random, bz0, bz1, 3 if narrow else 2):
                    yield (i, j, number), Lot(x0, z0, x1, z1)
                    number += 1


def split(random, low, high, parts):
    """Cuts an interval into `parts` lots with alleys between them, each within the footprint limits."""
    alley = ALLEY + random.between(0.0, 0.06) if parts == 2 else ALLEY
    free = high - low - alley * (parts - 1)
    play = free / parts - FOOTPRINTS[0] - 0.01
    cuts, start = [], low
    for _ in range(parts - 1):
        width = free / parts + random.between(-1, 1) * min(play / parts, 0.16)
        cuts.append((start, start + width))
        start += width + alley
    return cuts + [(start, high)]


def skyline(random, lot):
    """Roughly how high a building on this lot is: low at the water, high inland and near the middle."""
    x, z = lot.centre()
    inland = (x - CITY_X[0]) / (CITY_X[1] - CITY_X[0])
    middle = math.exp(-(((z - 7.2) / 4.2) ** 2))
    height = 1.05 + 2.3 * inland**1.2 + 1.5 * inland * middle
    return min(5.2, max(1.1, height * random.between(0.78, 1.3)))


def roof_boxes(random, plan, top):
    """One or two boxes (stairs, lifts, tanks) on a flat roof that is a rectangle."""
    low_x, high_x = min(p[0] for p in plan) + 0.1, max(p[0] for p in plan) - 0.1
    low_z, high_z = min(p[1] for p in plan) + 0.1, max(p[1] for p in plan) - 0.1
    wide, deep = high_x - low_x, high_z - low_z
    if min(wide, deep) < 0.25:
        return []
    size_x, size_z = random.between(0.3, 0.5) * wide, random.between(0.28, 0.42) * deep
    x, z = low_x + random.between(0.0, 1.0) * (wide - size_x), low_z
    boxes = [Tier(rectangle(x, z, x + size_x, z + size_z), top + random.between(0.12, 0.25))]
    if random.unit() < 0.5:
        size_x, size_z = 0.28 * wide, 0.3 * deep
        x = low_x + random.between(0.0, 1.0) * (wide - size_x)
        boxes.append(Tier(rectangle(x, high_z - size_z, x + size_x, high_z), top + random.between(0.08, 0.3)))
    return boxes


def flat_roof(random, plan, top, wall=0.1):
    """What stands on a flat rectangular roof: a floor sunk behind a parapet, with boxes on it."""
    floor_plan = inset(plan, wall)
    floor = top - random.between(0.08, 0.14)
    return [Tier(floor_plan, floor, roof_boxes(random, floor_plan, floor))]


def slab(random, lot, height):
    """A plain house with a parapet and roof boxes."""
    return Tier(lot.plan(), height, flat_roof(random, lot.plan(), height))


def gabled(random, lot, height):
    """A house under a gabled or hipped roof."""
    wide, deep = lot.size()
    axis = 0 if wide > deep else 1
    rise = random.between(0.28, 0.4) * min(wide, deep)
    hip = random.pick([0.0, 0.0, 0.3 * min(wide, deep)])
    return Tier(lot.plan(), max(height - rise, 0.75), roof=("ridge", rise, hip, axis))


def angled(random, lot, height):
    """An L: two wings around a yard, and a tower in their corner."""
    wide, deep = lot.size()
    cut_x, cut_z = random.between(0.38, 0.46) * wide, random.between(0.38, 0.46) * deep
    x0, z0, x1, z1 = lot.x0, lot.z0, lot.x1, lot.z1
    # The yard opens to the landward side, left or right.
    if random.unit() < 0.5:
        plan = [(x0, z0), (x0, z1), (x1, z1), (x1, z0 + cut_z), (x1 - cut_x, z0 + cut_z), (x1 - cut_x, z0)]
        tower = rectangle(x0 + 0.1, z0 + cut_z + 0.1, x1 - cut_x - 0.08, z1 - 0.1)
    else:
        plan = [(x0, z0), (x0, z1), (x1 - cut_x, z1), (x1 - cut_x, z1 - cut_z), (x1, z1 - cut_z), (x1, z0)]
        tower = rectangle(x0 + 0.1, z0 + 0.1, x1 - cut_x - 0.08, z1 - cut_z - 0.1)
    wings = height * random.between(0.55, 0.75)
    return Tier(plan, wings, [Tier(tower, height, roof_boxes(random, tower, height))])


def set_back(random, lot, height, tiers=None):
    """Two to four storeys of set-backs, each a little smaller, not always centred."""
    count = tiers or (2 if height < 3.0 else random.pick([2, 3]))
    plans, plan = [lot.plan()], lot.plan()
    for _ in range(count - 1):
        low_x, low_z = plan[0]
        high_x, high_z = plan[2]
        room = 0.18 * min(high_x - low_x, high_z - low_z)
        steps = [random.between(0.07, max(0.08, room)) for _ in range(4)]
        plan = rectangle(low_x + steps[0], low_z + steps[1], high_x - steps[2], high_z - steps[3])
        plans.append(plan)
    shares = [0.0]
    for k in range(count):
        shares.append(shares[-1] + (1.0 if k == 0 else random.between(0.35, 0.7)))
    tops = [height * share / shares[-1] for share in shares[1:]]
    last = plans[-1]
    small = min(last[2][0] - last[0][0], last[2][1] - last[0][1]) < 0.55
    crown = roof_boxes(random, last, tops[-1]) if small else flat_roof(random, last, tops[-1])
    tier = Tier(last, tops[-1], crown)
    for plan, top in zip(plans[-2::-1], tops[-2::-1]):
        tier = Tier(plan, top, [tier])
    return tier


def square_in(lot, margin):
    """The largest square in a lot, `margin` from its nearest sides: x0, z0, x1, z1."""
    x, z = lot.centre()
    half = min(lot.size()) / 2 - margin
    return x - half, z - half, x + half, z + half


def spire_tower(_random, lot, _height):
    """The tallest: a stepped shaft under a needle."""
    x0, z0, x1, z1 = square_in(lot, 0.1)
    shaft = rectangle(x0, z0, x1, z1)
    neck, collar = inset(shaft, 0.13), inset(shaft, 0.24)
    needle = Tier(collar, 5.35, roof=("spire", HEIGHTS[1] - 5.35))
    crown = Tier(neck, 5.05, [needle])
    return Tier(lot.plan(), 1.1, [Tier(shaft, 4.4, [crown])])


def drum_tower(random, lot, height):
    """A twelve-sided drum on a podium, with a smaller drum and a cone on top."""
    centre, radius = lot.centre(), min(lot.size()) / 2 - 0.08
    height = max(height, 3.3) + 0.4
    lantern = Tier(regular(centre, radius * 0.45, 12), height - 0.3, roof=("spire", 0.3))
    gallery = Tier(regular(centre, radius * 0.75, 12), height - random.between(0.55, 0.7), [lantern])
    drum = Tier(regular(centre, radius, 12), height - 1.0, [gallery])
    return Tier(lot.plan(), 0.8, [drum])


def tapered_tower(_random, lot, height):
    """Walls that lean inward, and a hipped top."""
    height = max(height, 4.1)
    foot = inset(lot.plan(), 0.08)
    head = inset(foot, 0.2 * min(lot.size()))
    shaft = Tier(foot, height, top_plan=head, roof=("spire", 0.55))
    return Tier(lot.plan(), 0.6, [shaft])


def octagon_tower(random, lot, height):
    """A shaft with cut corners, set back once."""
    x0, z0, x1, z1 = lot.x0, lot.z0, lot.x1, lot.z1
    cut = 0.22 * min(lot.size())
    height = max(height, 4.4)
    upper = chamfered(x0 + 0.16, z0 + 0.16, x1 - 0.16, z1 - 0.16, cut * 0.8)
    box = inset(upper, 0.16)
    top = Tier(upper, height, [Tier(box, height + random.between(0.2, 0.3))])
    return Tier(chamfered(x0, z0, x1, z1, cut), height * 0.62, [top])


def chapel(_random, lot, _height):
    """A low hall with a pointed tower over the water front."""
    low_x, low_z, _, _ = lot.x0, lot.z0, lot.x1, lot.z1
    tower = rectangle(low_x + 0.1, low_z + 0.1, low_x + 0.56, low_z + 0.56)
    return Tier(lot.plan(), 0.95, [Tier(tower, 1.75, roof=("spire", 0.85))])


def stepped_tower(random, lot, height):
    """Four set-backs."""
    return set_back(random, lot, max(height, 4.6), tiers=4)


KINDS = {
    "spire_tower": spire_tower,
    "drum_tower": drum_tower,
    "tapered_tower": tapered_tower,
    "octagon_tower": octagon_tower,
    "chapel": chapel,
    "stepped_tower": stepped_tower,
}


def ordinary(random, height):
    """What is usually built at this height."""
    if height < 1.7:
        return random.pick([gabled, gabled, slab, angled])
    if height < 2.6:
        return random.pick([slab, angled, set_back, gabled])
    return random.pick([set_back, set_back, slab, angled])


def city():
    """Every building's mesh, in the order of the lots."""
    random = Random(SEED)
    meshes = []
    for place, lot in list(lots(random)):
        height = skyline(random, lot)
        kind = KINDS.get(LANDMARKS.get(place)) or ordinary(random, height)
        if place not in SQUARES:
            meshes.append(building(kind(random, lot, height)))
    return meshes
