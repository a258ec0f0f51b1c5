"""A solitary wave on a plane beach, by fully nonlinear potential flow in two dimensions: its profile until it breaks, or its run-up.

Bilinear finite elements on columns that follow the surface solve Laplace's equation; the surface's elevation and potential follow the
kinematic and the dynamic condition (Zakharov 1968) by the classical Runge-Kutta method. The waterline is a particle that slides along
the beach, and the columns over the beach move with it. Lengths in depths, times in √(d/g).
"""

import math

import numpy as np
from scipy import sparse
from scipy.sparse import linalg

# Distance of columns at rest, on the flat bottom and over the beach; layers; step. With 0.04, 0.04, 13 and 0.02 the profile at t = 15 of
# a wave 0.3 high on 1:19.85 moves by less than 0.001, and the run-up of one 0.1 high on 15° by less than 0.0002.
COLUMN, OVER_BEACH, LAYERS, STEP = 0.06, 0.06, 9, 0.03
# Steps between two passes of a five-point filter, which takes out waves of two columns.
FILTERED = 4
# From the end of the domain to the crest at the start.
BEHIND = 6.0
# Points and weights of Gauss's rule on an element's sides.
GAUSS = (-1 / math.sqrt(3), 1 / math.sqrt(3))


def solitary_wave(height, x):
    """Elevation, and velocities along the wave's way and upward at the surface, to third order (Grimshaw 1971)."""
    e = height
    tanh = np.tanh(math.sqrt(0.75 * e) * (1 - 0.625 * e + 71 / 128 * e**2) * x)
    s, t = 1 - tanh**2, tanh**2
    elevation = e * (s + e * (-0.75 * s * t + e * (0.625 * s * t - 101 / 80 * s * s * t)))
    y = 1 + elevation
    second = -s / 4 + s**2 + y**2 * (1.5 * s - 2.25 * s**2)
    third = 0.475 * s + 0.2 * s**2 - 1.2 * s**3 + y**2 * (-1.5 * s - 3.75 * s**2 + 7.5 * s**3)
    third += y**4 * (-0.375 * s + 2.8125 * s**2 - 2.8125 * s**3)
    along = e * (s - e * (second + e * third))
    second = 0.375 * s + 2 * s**2 + y**2 * (0.5 * s - 1.5 * s**2)
    third = 49 / 640 * s - 0.85 * s**2 - 3.6 * s**3 + y**2 * (-0.8125 * s - 1.5625 * s**2 + 7.5 * s**3)
    third += y**4 * (-0.075 * s + 1.125 * s**2 - 1.6875 * s**3)
    upward = math.sqrt(3 * e) * y * tanh * e * (s - e * (second + e * third))
    return elevation, along, upward


class Tank:
    """Columns of elements from a wall to the waterline."""

    def __init__(self, height, cot, crest=BEHIND, toe=None, column=COLUMN, over_beach=OVER_BEACH, layers=LAYERS):
        if toe is None:
            toe = crest + math.acosh(math.sqrt(20)) / math.sqrt(0.75 * height)
        self.cot, self.toe, self.shore = cot, toe, toe + cot
        self.flat = np.linspace(0, toe, round(toe / column) + 1)
        beach = round(cot / over_beach)
        self.part = np.arange(1, beach + 1) / beach
        self.layer = np.linspace(0, 1, layers)
        columns = len(self.flat) + beach
        place = np.arange(columns * layers).reshape(columns, layers)
        # All nodes of the last column are one point, the waterline.
        node = place.copy()
        node[-1] = place[-1, 0]
        corners = (slice(-1), slice(-1)), (slice(1, None), slice(-1)), (slice(1, None), slice(1, None)), (slice(-1), slice(1, None))
        self.place = np.stack([place[corner].ravel() for corner in corners], -1)
        self.element = np.stack([node[corner].ravel() for corner in corners], -1)
        self.nodes = place[-1, 0] + 1
        self.top = node[:, -1]
        self.below = np.setdiff1d(np.arange(self.nodes), self.top)

        x = self.columns(self.shore)
        elevation, along, upward = solitary_wave(height, x - crest)
        elevation[-1] = 0
        slope = along + upward * np.gradient(elevation, x)
        potential = np.concatenate([[0], np.cumsum((slope[1:] + slope[:-1]) / 2 * np.diff(x))])
        # Elevations, potentials, and where the waterline is.
        self.state = np.concatenate([elevation, potential, [self.shore]])

    def columns(self, waterline):
        return np.concatenate([self.flat, self.toe + self.part * (waterline - self.toe)])

    def split(self, state):
        """Elevations, potentials, the waterline, and where the columns are."""
        count = len(state) // 2
        return state[:count], state[count:-1], state[-1], self.columns(state[-1])

    def bottom(self, x):
        return np.maximum(-1, (x - self.shore) / self.cot)

    def stiffness(self, x, elevation):
        """The matrix of ∫ ∇N · ∇N over the water."""
        bottom = self.bottom(x)
        height = bottom[:, None] + self.layer * (elevation - bottom)[:, None]
        place = np.stack([np.repeat(x, len(self.layer)), height.ravel()], -1)[self.place]
        total = 0
        for a in GAUSS:
            for b in GAUSS:
                shape = np.array([[b - 1, a - 1], [1 - b, -1 - a], [1 + b, 1 + a], [-1 - b, 1 - a]]) / 4
                jacobian = np.einsum("ki,ekj->eij", shape, place)
                gradient = np.einsum("eji,ki->ekj", np.linalg.inv(jacobian), shape)
                total += np.einsum("eki,eli,e->ekl", gradient, gradient, np.linalg.det(jacobian))
        rows, columns = np.repeat(self.element, 4, 1), np.tile(self.element, (1, 4))
        return sparse.csr_matrix((total.ravel(), (rows.ravel(), columns.ravel())), shape=(self.nodes, self.nodes))

    def rates(self, state):
        """How fast the state changes, in columns that move with the waterline."""
        elevation, surface, waterline, x = self.split(state)
        matrix = self.stiffness(x, elevation)
        potential = np.zeros(self.nodes)
        potential[self.top] = surface
        known = -(matrix[self.below][:, self.top] @ surface)
        potential[self.below] = linalg.spsolve(matrix[self.below][:, self.below].tocsc(), known)
        # What flows through the surface over a column raises it.
        width = np.diff(x)
        across = (np.append(width, 0) + np.insert(width, 0, 0)) / 3
        mass = sparse.diags([width / 6, across, width / 6], [-1, 0, 1]).tocsc()
        rising = linalg.spsolve(mass, (matrix @ potential)[self.top])
        tilt, along = (np.gradient(of, x, edge_order=2) for of in (elevation, surface))
        upward = (rising + along * tilt) / (1 + tilt**2)
        changing = -elevation - along**2 / 2 + upward**2 / 2 * (1 + tilt**2)
        # Along the beach, the waterline is as fast as the potential changes along the surface, over the cosine between both.
        beach = np.array([self.cot, 1]) / math.hypot(self.cot, 1)
        speed = along[-1] / (beach @ [1, tilt[-1]])
        moving = np.concatenate([np.zeros(len(self.flat)), self.part * speed * beach[0]])
        rising += moving * tilt
        changing += moving * along
        rising[-1] = speed * beach[1]
        changing[-1] = speed**2 / 2 - elevation[-1]
        return np.concatenate([rising, changing, [moving[-1]]])

    def advance(self, until, step=STEP):
        """Runs on for a time; returns how high the waterline has been."""
        highest = -math.inf
        for number in range(1, round(until / step) + 1):
            first = self.rates(self.state)
            second = self.rates(self.state + step / 2 * first)
            third = self.rates(self.state + step / 2 * second)
            fourth = self.rates(self.state + step * third)
            self.state = self.state + step / 6 * (first + 2 * second + 2 * third + fourth)
            elevation, surface, waterline, _ = self.split(self.state)
            elevation[-1] = (waterline - self.shore) / self.cot
            highest = max(highest, elevation[-1])
            if number % FILTERED == 0:
                for of in (elevation, surface):
                    of[2:-2] = (-of[:-4] + 4 * of[1:-3] + 10 * of[2:-2] + 4 * of[3:-1] - of[4:]) / 16
        return highest

    def profile(self, distances):
        """Elevations at distances from the shoreline of still water towards the sea."""
        elevation, _, _, x = self.split(self.state)
        return np.interp(self.shore - distances, x, elevation)
