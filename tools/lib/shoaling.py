"""A solitary wave that climbs a plane beach, by fully nonlinear potential flow in two dimensions, until it is about to break.

Bilinear finite elements on columns that follow the surface solve Laplace's equation; the surface's elevation and potential follow the
kinematic and the dynamic condition (Zakharov 1968) by the classical Runge-Kutta method. Lengths in depths, times in √(d/g).
"""

import math

import numpy as np
from scipy import sparse
from scipy.sparse import linalg

# Distance of columns, layers, step. With 0.04, 13 and 0.02 the profile at t = 15 of a wave 0.3 high moves by less than 0.001.
COLUMN, LAYERS, STEP = 0.06, 9, 0.03
# Steps between two passes of a five-point filter, which takes out waves of two columns.
FILTERED = 4
# From the end of the domain to the crest at the start; depth at the last column.
BEHIND, LEAST_DEPTH = 6.0, 0.06
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
    """Columns of elements from a wall to the beach."""

    def __init__(self, height, cot, column=COLUMN, layers=LAYERS):
        toe = BEHIND + math.acosh(math.sqrt(20)) / math.sqrt(0.75 * height)
        self.shore = toe + cot
        self.column = column
        self.x = np.arange(0, self.shore - LEAST_DEPTH * cot, column)
        self.depth = np.minimum(1, (self.shore - self.x) / cot)
        self.layer = np.linspace(0, 1, layers)
        node = np.arange(len(self.x) * layers).reshape(len(self.x), layers)
        corners = (node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:])
        self.element = np.stack([corner.ravel() for corner in corners], -1)
        self.top = node[:, -1]
        self.below = node[:, :-1].ravel()
        diagonals = [np.full(len(self.x) - 1, column / 6), np.full(len(self.x), 2 * column / 3), np.full(len(self.x) - 1, column / 6)]
        diagonals[1][[0, -1]] /= 2
        self.mass = sparse.diags(diagonals, [-1, 0, 1]).tocsc()

        elevation, along, upward = solitary_wave(height, self.x - BEHIND)
        slope = along + upward * np.gradient(elevation, column)
        potential = np.concatenate([[0], np.cumsum((slope[1:] + slope[:-1]) / 2 * column)])
        self.state = np.array([elevation, potential])

    def stiffness(self, elevation):
        """The matrix of ∫ ∇N · ∇N over the water."""
        height = -self.depth[:, None] + self.layer * (self.depth + elevation)[:, None]
        place = np.stack([np.repeat(self.x, len(self.layer)), height.ravel()], -1)[self.element]
        total = 0
        for a in GAUSS:
            for b in GAUSS:
                shape = np.array([[b - 1, a - 1], [1 - b, -1 - a], [1 + b, 1 + a], [-1 - b, 1 - a]]) / 4
                jacobian = np.einsum("ki,ekj->eij", shape, place)
                gradient = np.einsum("eji,ki->ekj", np.linalg.inv(jacobian), shape)
                total += np.einsum("eki,eli,e->ekl", gradient, gradient, np.linalg.det(jacobian))
        rows, columns = np.repeat(self.element, 4, 1), np.tile(self.element, (1, 4))
        nodes = len(self.x) * len(self.layer)
        return sparse.csr_matrix((total.ravel(), (rows.ravel(), columns.ravel())), shape=(nodes, nodes))

    def rates(self, state):
        """How fast elevation and surface potential change."""
        elevation, surface = state
        matrix = self.stiffness(elevation)
        potential = np.zeros(matrix.shape[0])
        potential[self.top] = surface
        known = -(matrix[self.below][:, self.top] @ surface)
        potential[self.below] = linalg.spsolve(matrix[self.below][:, self.below].tocsc(), known)
        # What flows through the surface over a column raises it.
        rising = linalg.spsolve(self.mass, (matrix @ potential)[self.top])
        tilt, along = np.gradient(elevation, self.column), np.gradient(surface, self.column)
        upward = (rising + along * tilt) / (1 + tilt**2)
        return np.array([rising, -elevation - along**2 / 2 + upward**2 / 2 * (1 + tilt**2)])

    def advance(self, until, step=STEP):
        """Runs to a time."""
        steps = round(until / step)
        for number in range(1, steps + 1):
            first = self.rates(self.state)
            second = self.rates(self.state + step / 2 * first)
            third = self.rates(self.state + step / 2 * second)
            fourth = self.rates(self.state + step * third)
            self.state = self.state + step / 6 * (first + 2 * second + 2 * third + fourth)
            if number % FILTERED == 0:
                s = self.state
                middle = (-s[:, :-4] + 4 * s[:, 1:-3] + 10 * s[:, 2:-2] + 4 * s[:, 3:-1] - s[:, 4:]) / 16
                self.state = np.concatenate([s[:, :2], middle, s[:, -2:]], 1)

    def profile(self, distances):
        """Elevations at distances from the shoreline of still water towards the sea."""
        return np.interp(self.shore - distances, self.x, self.state[0])
