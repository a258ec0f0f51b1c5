//! What a check of FLIP compares, and where each tolerance comes from; u = 2⁻²⁴, N cells along the domain's longest
//! side: a particle's place in its cell errs by 3 u N.
//! What the projection computes in f64, where the scene asks for that, has u = 2⁻⁵³: the system, its right-hand side,
//! products, differences of the solution, the residual. Velocities, displacements and pascals stay f32.

use crate::compare::check::fields;

fields! {
    SPEED = "flip/survey", "largest speed squared", "m²/s²", "5 u";
    WET = "flip/survey", "bricks with water", "", "equal";
    CELL = "flip/assign_cells", "cell", "", "equal; within 4 u x/Δx of a cell's face either is right";
    COUNTS = "flip/assign_cells", "particles in cells", "", "whole numbers: equal";
    SLOTS = "flip/assign_cells", "slots in cells", "", "whole numbers: each slot once";
    POSITION = "flip/reorder", "position", "m", "a copy: equal";
    VELOCITY = "flip/reorder", "velocity", "m/s", "a copy: equal";
    ID = "flip/reorder", "id", "", "a copy: equal";
    AFFINE = "flip/reorder", "affine rows", "1/s", "a copy: equal";
    KIND = "flip/cut_cells", "kind of cell", "", "equal; a tie where it turns as the solids' distances move by their rounding";
    OPEN = "flip/cut_cells", "open fraction", "",
        "8 u N, and 3 times what it changes by as the solids' distances move by theirs, u (7 |x − x0| + |x0| + 48 spacings)";
    FLUX = "flip/cut_cells", "flux of solids", "m/s",
        "the open fractions' tolerance times the walls' speed, 6 faces; and so for solids";
    VOLUME = "flip/cut_cells", "open volume", "", "as the open fraction";
    CLOSED = "flip/cut_cells", "velocity of closed faces", "m/s", "a solid's: 2 u; a tie where another turns out to be nearest, or none, as distances and nodes move by their rounding";
    OLD = "flip/gather_faces", "velocity at faces", "m/s",
        "12 u N (particles about) / (their weight), at most 1, of the range of their velocities, + u (particles + 20) |v|";
    NEW = "flip/gather_faces", "velocity with gravity", "m/s", "the same + 2 u g Δt";
    KNOWN = "flip/gather_faces", "whether particles are near", "", "equal";
    DENSITY = "flip/gather_centers", "relative density", "",
        "share (9 u N (particles about) + u (particles + 40) Σ) / room + 16 u N of it";
    EXCESS = "flip/gather_centers", "density excess", "", "the density's";
    DISTANCE = "flip/gather_centers", "distance of the surface", "m",
        "what the twin answers when the density moves by its tolerance, + 24 u";
    DIRICHLET = "pressure/build_system", "what air adds to the diagonal", "", "16 u of each quotient, 6 sums: 24 u";
    COEFFICIENT = "pressure/build_system", "coefficients", "", "copies: equal";
    ROWS = "pressure/build_system", "rows", "", "equal";
    INVERSE = "pressure/build_system", "inverse diagonal", "", "what air adds 24 u, 6 sums, a quotient: 36 u";
    COARSE_COEFFICIENT = "pressure/coarsen", "coefficients", "", "a sum of four: 3 u";
    COARSE_AIR = "pressure/coarsen", "what air adds to the diagonal", "", "a sum of eight: 8 u";
    COARSE_KIND = "pressure/coarsen", "kind of block", "", "equal";
    LABELS = "pressure/count_pockets", "labels of water that no air touches", "", "the least place of each: equal";
    POCKETS = "pressure/count_pockets", "pockets", "", "equal";
    CENTERED = "pressure/center", "values less their mean", "", "the mean u (cells / 256 + 14) of the mean magnitude, + u";
    SCALARS = "pressure/reduce", "sums and what follows", "", "u (bricks / 256 + 60) of the sum of magnitudes, quotients 4 u";
    DECIDED = "pressure/reduce", "state, iterations, restarts", "", "equal; a tie where the sum is that near to its target";
    PRECONDITIONED = "pressure/precondition", "correction", "", "a product: u; without the diagonal a copy";
    IPP_LOWER = "pressure/ipp_lower", "first half", "", "3 products, 4 sums: 9 u of the sum of magnitudes";
    IPP_UPPER = "pressure/ipp_upper", "correction", "", "likewise";
    SMOOTHED_FIRST = "pressure/smooth_first", "correction", "",
        "each block solved with 40 u (|A| |z| + |b|) on its right-hand side (Higham 2002, theorem 9.3); a tie where a pivot is \
         below 2e-5 of its diagonal";
    SMOOTHED = "pressure/smooth", "correction", "", "likewise";
    SMOOTHED_CORRECTED = "pressure/smooth_corrected", "correction", "", "likewise";
    RESTRICTED = "pressure/restrict", "residual of the coarser level", "", "products and 6 sums: 8 u of half the sum of magnitudes";
    COARSE_SOLVED = "pressure/solve_coarse", "correction", "",
        "the same steps in f64 with a bound beside each value: a block's 40 u as of pressure/smooth and a restriction's 8 u, each \
         carried on through the blocks after it, whose inverses have no negative entry; a tie where a pivot is below 2e-5 of its \
         diagonal";
    COARSE_RESIDUAL = "pressure/solve_coarse", "residuals of the coarser levels", "", "likewise";
    DIRECTED = "pressure/direction", "direction", "", "2 u (|z| + |β p|)";
    ADVANCED_SOLUTION = "pressure/advance", "solution, both words", "",
        "u of the lesser word, and 4 u of what the greater one rounds off and of α p beyond its factors' leading 12 bits, 2⁻⁹";
    ADVANCED_RESIDUAL = "pressure/advance", "residual", "", "2 u (|r| + |α A p|)";
    VERIFIED_RESIDUAL = "pressure/verify", "residual", "", "12 u Σ c |x − x'| of both words, + 2 u of each difference";
    RHS = "pressure/divergence", "right-hand side", "m/s", "7 products and sums: 10 u Σ|f u|";
    BEFORE = "pressure/divergence", "largest divergence", "1/s", "10 u of the largest Σ|f u| over Δx";
    PRODUCT = "pressure/multiply", "system times direction", "m/s", "by differences: 12 u Σ c |x − x'|";
    PROJECTED = "pressure/project", "velocity at faces", "m/s", "24 u |Δq|/θ of each of its two words, which may cancel, + 2 u |v|";
    PRESSURE = "pressure/project", "pressure", "Pa", "4 u p";
    AFTER = "pressure/measure_divergence", "largest divergence", "1/s", "10 u of the largest Σ|f u| over Δx";
    SOURCE = "pressure/density_source", "right-hand side", "m", "2 u";
    DISPLACEMENT = "pressure/displace", "displacement at faces", "m", "24 u |Δq|/θ of each of its terms + u (f32) of it";
    WORK = "flip/boundary_work", "shares of the work", "W/m²", "64 products and sums: 66 u Σ|p f|";
    CHANGE = "flip/find_change", "change at faces", "m/s", "one difference: u";
    LAYER = "flip/find_change", "layers", "", "equal";
    SPREAD_VELOCITY = "flip/extrapolate", "velocity at faces", "m/s", "a mean of six and two sums: 12 u of the largest";
    SPREAD_CHANGE = "flip/extrapolate", "change at faces", "m/s", "likewise";
    SPREAD_LAYER = "flip/extrapolate", "layers", "", "equal";
    GIVEN = "flip/grid_to_particle", "velocity", "m/s",
        "9 u N of the range of the faces' values and changes about the cell, + 32 u of the largest";
    CARRIED = "flip/grid_to_particle", "velocity of the grid", "m/s", "likewise";
    SHIFT = "flip/grid_to_particle", "displacement", "m", "likewise";
    GIVEN_AFFINE = "flip/grid_to_particle", "affine rows", "1/s", "likewise, twice over Δx";
    MOVED = "flip/advect", "position", "m",
        "what the twin answers when its start moves along each axis by u (8 |x| + 30 Δt |v|), with solids 7 u of the distance \
         to the grid's origin more, + u |x|";
    ADVECTED = "flip/advect", "velocity", "m/s", "what the twin answers likewise, + 8 u |v|, with solids of what came in and of theirs too";
    CAPPED = "flip/advect", "particles slowed", "", "equal, but for what the moved starts change";
    MOVED_ID = "flip/advect", "id", "", "a copy: equal";
    RESIDUAL = "whole projection", "‖b − A x‖ / ‖b‖", "", "solver.flip.pressure.tolerance, and what f32 measures it by: 12 u ‖Σ c |x − x'|‖ / ‖b‖";
    SOLUTION = "whole projection", "‖p − p64‖ / ‖p64‖", "",
        "1.5 times the residual's tolerance ‖b‖ / (λ ‖p64‖), λ the least eigenvalue by eight inverse iterations on the direct factor";
    ENERGY = "whole projection", "‖u − u64‖", "m/s",
        "each face weighted by √(f θ), which is the norm of the pressure's error by the system: 1.5 times the residual's \
         tolerance ‖b‖ / √λ";
    DIVERGENCE = "whole projection", "‖∇·u‖ after / before", "",
        "the residual's tolerance and 30 u (‖Σ|f u|‖ + ‖Σ c |x − x'|‖) / ‖b‖ by the velocities' rounding";
    CORRECTION = "whole correction", "‖b − A x‖ / ‖b‖", "", "its tolerance, 1e-2";
}
