//! Values that a check of FLIP compares, and their tolerances; U = 2⁻²⁴. If the scene asks for f64,
//! the parts of the projection that are computed in f64 have `unit` = 2⁻⁵³ instead of U: the
//! system, its right-hand side, products, differences of the solution, the residual. Velocities,
//! displacements and pressures in Pa remain f32.

use crate::{
    solids::{FLOWED, GRID},
    sort::NEAR_FACE,
    table::entries,
};
use swell_compare::{deviation::relative, rounding::U, tolerance::bounds};

bounds! {
    pub(super) PLACE = [cells: "cells along the domain's longest side"] U * cells, "";
    pub(super) CUT = [place: "" PLACE] 8.0 * place, "";
    pub(super) PARTS = [place: "" PLACE]
        2.0 * place, "a half cell, beyond which a wall leaves a layer nothing";
    TURN = [grid: "" GRID]
        grid, "the solids' distance at which it turns, and where nodes are as near";
    pub(super) OF_FACE = [place: "" PLACE, count: "particles about",
        weight: "what their hats add up to", range: "of their velocities",
        most: "their largest |v|"]
        (12.0 * place * count / weight).min(1.0) * range + U * (count + 20.0) * most,
        "along each axis";
    pub(super) OF_CENTER = [share: "1 / particles of a full cell", place: "" PLACE,
        count: "particles about",
        least: "half of the open volume about or of the hat, at least 0.02",
        part: "share × count / least, or the density where it is less"]
        share * place * 48.0 * count / least + part * (U * (count + 40.0) + 16.0 * place),
        "along three axes a place and twice a wall's, times two weights of 2 at \
         most, as images double them";
    pub(super) OF_MEAN = [density: "the largest about"]
        20.0 * U * density, "a mean over six faces, and the cell's own with a part";
    pub(super) OF_HALF = [mean: "" OF_MEAN]
        mean + 0.25 * U, "a density's difference from a half, which is half of 1 at most";
    pub(super) OF_SOLID =
        [tilt: "how fast what is below the surface changes with the squared cosine of the \
            solid's tilt, over the length of the hats' differences beside the cell"]
        (44.0 * U * tilt).min(1.0),
        "differences, sums of three products, and a quotient of 2.5 ulp";
    pub(super) OF_LAYERS = [half: "" OF_HALF,
        water: "how fast what is below the surface changes with the water in a cut cell"]
        (water * (half + 6.0 * U) + 20.0 * U * water.min(1.0)).max(half),
        "what is left above a layer, a quotient of 2.5 ulp, and ten roundings of each";
    pub(super) OF_SHARE = [layers: "" OF_LAYERS, solid: "" OF_SOLID] layers + solid, "";
    pub(super) NEAR_HALF = [cut: "" CUT, mean: "" OF_MEAN] cut + mean,
        "a half, of the density or of what is open of a cell about";
    pub(super) OF_GAP = [cut: "" CUT]
        9.0 * (cut + 8.0 * U) + 64.0 * U,
        "what at most 9 cells lack, and a difference of velocities by which ends come \
         at most 8 cells nearer";
    pub(super) OF_FACES = [place: "" PLACE, range: "of the faces' values about the cell",
        most: "the largest of them"]
        9.0 * place * range + 96.0 * U * most,
        "along each axis; three sums over 18 faces, and their quotient";
    pub(super) START = [x: "|x|", step: "Δt", fastest: "|v| at any face", grid: "with solids " GRID]
        U * (8.0 * x + 30.0 * step * fastest) + grid, "";

    pub(super) OF_DIFFERENCE = [unit: "U, or 2⁻⁵³ with f64",
        difference: "|Δq| / min(θ, 1) of a word of the solution"]
        24.0 * unit * difference, "";
    pub(super) OF_BLOCK = [unit: "U, or 2⁻⁵³ with f64", row: "|A| |z|",
        size: "the sum of magnitudes of b"]
        40.0 * unit * (row + size),
        "Higham 2002, theorem 9.3; the inverse has no negative entry, so that \
         bounds take the same steps";
    pub(super) OF_RESTRICTION = [unit: "U, or 2⁻⁵³ with f64", size: "Σ|c z|"]
        4.0 * unit * size, "products and 6 sums, halved";
    PIVOT = [] 2e-5, "a pivot of 0, as a part of the block's diagonal";
    pub(super) OF_SUM = [unit: "U, or 2⁻⁵³ with f64", count: "sums of bricks", size: "Σ|terms|"]
        unit * (count / 256.0 + 60.0) * size, "8 cells a thread, 64 threads, and the bricks";
    pub(super) QUOTIENT = [sum: "" OF_SUM, value: "the sum", unit: "U, or 2⁻⁵³ with f64"]
        (sum / value).abs() + 4.0 * unit, "";
    pub(super) OF_ALPHA = [alpha: "|α|", part: "" QUOTIENT] alpha * part / (1.0 - part), "";
    pub(super) OF_BETA = [sum: "" OF_SUM, unit: "U, or 2⁻⁵³ with f64", value: "|the sum|",
        before: "that before it"]
        ((sum + 4.0 * unit * value) / before).abs(), "";
    pub(super) OF_FORESEEN = [unit: "U, or 2⁻⁵³ with f64", terms: "‖r‖² + 2 |α r·q| + α² ‖q‖²",
        alpha: "|α|", moved: "" OF_ALPHA, overlap: "|r·q|", of_overlap: "its " OF_SUM,
        square: "‖q‖²", of_square: "its " OF_SUM]
        8.0 * unit * terms + 2.0 * (alpha * of_overlap + moved * (overlap + of_overlap))
            + alpha * alpha * of_square
            + moved * (2.0 * alpha + moved) * (square + of_square), "";
    pub(super) NEAR_TARGET = [sum: "" OF_SUM, unit: "U, or 2⁻⁵³ with f64",
        target: "‖b‖² tolerance², or 0"]
        sum + 2.0 * unit * target, "the target";
    pub(super) ONE_WORD = [unit: "U, or 2⁻⁵³ with f64", way: "|α p|", x: "|x|"]
        unit * (2.0 * way + x), "";
    pub(super) LOST = [unit: "U", large: "|the greater word|", way: "|α p|"]
        unit * large + way / 512.0,
        "what that word rounds off, and of α p what is beyond its factors' leading 12 bits";
    pub(super) TWO_WORDS = [unit: "U", small: "|the lesser word|", lost: "" LOST]
        unit * (small + 4.0 * lost), "";

    pub(super) ALLOWED = [asked: "tolerance of the solve", unit: "U, or 2⁻⁵³ with f64",
        spread: "‖Σ c |x − x'|‖", b: "‖b‖"]
        asked * (1.0 + 1e-6) + relative(12.0 * unit * spread, b),
        "what it is measured by rounds too";
    pub(super) FAR = [residual: "" ALLOWED, b: "‖b‖"] 1.5 * residual * b, "";
}

entries! {
    "flip/survey" {
        SPEED = "largest speed squared", "m²/s²": [square: "|v|²"]
            5.0 * U * square, "products and sums";
        WET = "bricks with water", "": [] 0.0, "flags";
    }
    "flip/assign_cells" {
        CELL = "cell", "": [] 0.0, "a whole number", tie NEAR_FACE;
        COUNTS = "particles in cells", "": [] 0.0, "whole numbers";
        SLOTS = "slots in cells", "": [] 0.0, "whole numbers: each slot once";
    }
    "flip/reorder" {
        POSITION = "position", "m": [] 0.0, "a copy";
        VELOCITY = "velocity", "m/s": [] 0.0, "a copy";
        ID = "id", "": [] 0.0, "a copy";
        AFFINE = "affine rows", "1/s": [] 0.0, "a copy";
    }
    "flip/cut_cells" {
        KIND = "kind of cell", "": [] 0.0, "a whole number", tie TURN;
        OPEN = "open fraction", "": [cut: "" CUT,
            moved: "what it changes by as solids' distances move by " GRID]
            cut + 3.0 * moved, "";
        FLUX = "flux of solids", "m/s": [cut: "" CUT, speed: "the fastest wall's or solid's",
            moved: "what it changes by as solids' distances move by " GRID]
            6.0 * cut * speed + (cut + 3.0 * moved), "6 faces";
        VOLUME = "open volume", "": [cut: "" CUT,
            moved: "what it changes by as solids' distances move by " GRID]
            cut + 3.0 * moved, "";
        HATS = "open part of the hat", "": [cut: "" CUT,
            moved: "what it changes by as solids' distances move by " GRID]
            8.0 * cut + 3.0 * moved, "64 parts";
        LAYERS = "open part of the hat's layers", "": [cut: "" CUT,
            moved: "what it changes by as solids' distances move by " GRID]
            8.0 * cut + 3.0 * moved + 1.0 / 131_070.0, "16 parts each, stored in 16 bits",
            tie PARTS;
        FACE_WEIGHT = "weight of faces for particles", "": [cut: "" CUT,
            moved: "what it changes by as solids' distances move by " GRID,
            turned: "that over their growth about a face"]
            cut + 3.0 * moved + 48.0 * turned + 24.0 * U,
            "four for the square of 2 f − 1, two for f, a growth along each of three axes off by \
             twice a distance's error; a quotient of 2.5 ulp and seven roundings";
        CLOSED = "velocity of closed faces", "m/s": [v: "|v|",
            far: "the largest of solids' |spin| (|x| + |its point of rest|)",
            shape: "of shapes that change " FLOWED]
            2.0 * U * v + 6.0 * U * far + shape, "a solid's, unless another is nearest", tie TURN;
    }
    "flip/gather_faces" {
        OLD = "velocity at faces", "m/s": [face: "" OF_FACE] face, "";
        NEW = "velocity with gravity", "m/s": [face: "" OF_FACE, gravity: "g Δt", v: "|v|"]
            face + 2.0 * U * (gravity + v), "";
        KNOWN = "whether particles are near", "": [] 0.0, "flags";
    }
    "flip/place_deep" {
        DEEP_DEPTH = "depth below the surface", "cells": [] 0.0, "a copy";
        DEEP_OLD = "velocity in the depth", "m/s": [] 0.0, "a copy";
        DEEP_NEW = "velocity in the depth with gravity", "m/s": [gravity: "g Δt", v: "|v|"]
            2.0 * U * (gravity + v), "";
        DEEP_KNOWN = "whether there is a velocity", "": [] 0.0, "flags";
    }
    "flip/carry_deep" {
        CARRIED_VELOCITY = "velocity in the depth", "m/s": [place: "in cells, " START,
            range: "of the velocities that the water may come from", most: "the largest of them"]
            (6.0 * place + 64.0 * U) * range + 128.0 * U * most,
            "along each axis, slopes of cubic weights that add up to 2 at most; 64 products, \
             weights of four factors; where the place is as near to the border of two cells, \
             either's bounds";
        CARRIED_DEPTH = "depth below the surface", "cells": [place: "in cells, " START,
            range: "of the depths that the water may come from", most: "the largest of them"]
            3.0 * place * range + 32.0 * U * most, "along each axis; 8 products";
    }
    "flip/gather_centers" {
        RELATIVE_DENSITY = "relative density", "": [center: "" OF_CENTER] center, "";
    }
    "flip/find_water" {
        WATER = "kind of cell", "": [] 0.0, "a whole number", tie NEAR_HALF;
        DISTANCE = "distance of the surface", "m":
            [moved: "in cells, what it answers when s − s²/2 moves by " OF_SHARE, size: "Δx"]
            (moved + 24.0 * U) * size, "", tie NEAR_HALF;
    }
    "flip/close_gaps" {
        FILLING = "kind of cell", "": [] 0.0, "a whole number", tie OF_GAP;
        FILLED = "flux with what fills gaps", "m/s": [gap: "" OF_GAP, rate: "Δx / Δt",
            flux: "its own value"]
            16.0 * gap * rate + 2.0 * U * flux,
            "what 3 cells lack, times a part whose gap is a quarter of a cell at least", tie OF_GAP;
        FULL = "distance of the surface", "m": [size: "its own value, or that before",
            change: "what an inflow can change it by",
            flow: "Σ|terms of the inflow| / the least inflow"]
            4.0 * U * size + (7.0 * flow + 48.0) * U * change,
            "a cell, a copy, or a mix of both: 4 operations, a sum of 7 products, and at most \
             twice its quotient (5 u) by a length (16 u) of a rounded velocity (1 u)", tie OF_GAP;
    }
    "flip/find_strain" {
        STRAIN = "weight of the midpoint rule", "": [terms: "the largest Σ|products of slopes| \
            (Δt / Δx)² about, over what bends paths"]
            U * (24.0 * terms + 4.0),
            "15 products of differences or of sums of two, their sum, and a difference", tie CUT;
    }
    "flip/find_contraction" {
        CONTRACTION = "flux that makes up for contraction", "m/s": [terms: "Σ|products| Δt / Δx"]
            60.0 * U * terms,
            "products of a mean of four, an open part and a part between eight bricks", tie CUT;
    }
    "flip/find_excess" {
        EXCESS = "density excess", "": [excess: "|ρ − 1| with ρ", cut: "" CUT]
            4.0 * U * excess + cut * excess, "a difference, and the product with the open volume";
    }
    "flip/let_in" {
        LET_IN = "flux with what enters", "m/s": [rate: "(1 + ρ) Δx times the rate", cut: "" CUT,
            flux: "its own value"]
            (6.0 * U + cut) * rate + U * flux,
            "4 products, a difference, the open volume, and a sum";
        LEFT_EXCESS = "density excess", "": [] 0.0, "a choice";
    }
    "flip/wall_friction" {
        FRICTION = "velocity slowed by walls", "m/s": [place: "" PLACE,
            moved: "what it is slowed by in Δt where a row is a whole cell nearer to each wall",
            slowed: "Δt times the rate", v: "|v|"]
            (2.0 * place * moved + U * (16.0 * slowed + 4.0)) * v, "";
    }
    "flip/couple_bodies" {
        TOUCHED_AREA = "area of bodies in cells", "": [cut: "" CUT,
            moved: "what it changes by as solids' distances move by " GRID]
            6.0 * cut + 3.0 * moved, "6 faces", tie TURN;
        TOUCHED_MOMENT = "moment of that area", "m": [cut: "" CUT,
            arm: "distance from the centre of mass",
            moved: "what it changes by as solids' distances move by " GRID]
            (12.0 * cut + 8.0 * U) * arm + 3.0 * moved, "6 faces, 2 products each", tie TURN;
        WEIGHT = "weight between cells' centres and bodies", "m/s": [cut: "" CUT,
            cells: "cells that the body touches, times g Δt and for turns the domain's length",
            moved: "what it changes by as solids' distances move by " GRID]
            (4.0 * cut + 16.0 * U) * cells + 3.0 * moved, "3 volumes and their sums", tie TURN;
        RESPONSE = "response of bodies", "": [own: "its own value",
            turned: "the largest of the rows of turns"]
            2.0 * U * own + 16.0 * U * turned, "rounded; from a rounded pose";
    }
    "pressure/push_bodies" {
        PUSH = "sums of pressures over bodies", "": [unit: "U, or 2⁻⁵³ with f64", size: "Σ|J q|"]
            74.0 * unit * size, "8 cells a thread, 64 threads, 2 words";
    }
    "pressure/move_bodies" {
        BODY_CHANGE = "change of bodies' velocities", "": [unit: "U, or 2⁻⁵³ with f64",
            terms: "pairs of bodies and bricks", size: "|R| Σ|sums|"]
            unit * (terms / 64.0 + 72.0) * size, "a thread's pairs, 64 threads, 6 products";
    }
    "pressure/couple" {
        COUPLED_PRODUCT = "system times direction, with bodies", "m/s":
            [unit: "U, or 2⁻⁵³ with f64", size: "Σ|J v|", own: "its own value"]
            unit * (16.0 * size + own), "6 products and sums for each of two bodies, and a sum";
        COUPLED_RESIDUAL = "residual, with bodies", "m/s":
            [unit: "U, or 2⁻⁵³ with f64", size: "Σ|J v|", own: "its own value"]
            unit * (16.0 * size + own), "6 products and sums for each of two bodies, and a sum";
    }
    "pressure/carry_flux" {
        CARRIED_FLUX = "flux of bodies", "m/s":
            [unit: "U, or 2⁻⁵³ with f64", size: "Σ|J v|", own: "its own value"]
            16.0 * unit * size + 2.0 * U * (own + size), "a sum in f32";
    }
    "flip/carry_bodies" {
        CARRIED_FACES = "velocity of closed faces", "m/s":
            [most: "the largest |change| of a point in the domain", own: "its own value"]
            16.0 * U * most + U * own, "2 products and 3 sums", tie TURN;
    }
    "pressure/build_system" {
        DIRICHLET = "what air adds to the diagonal", "": [unit: "U, or 2⁻⁵³ with f64",
            air: "Σ f / min(θ, 1)"]
            24.0 * unit * air, "16 u of each quotient, 6 sums";
        COEFFICIENT = "coefficients", "": [] 0.0, "copies";
        ROWS = "rows", "": [] 0.0, "flags";
        INVERSE = "inverse diagonal", "": [unit: "U, or 2⁻⁵³ with f64",
            inverse: "its own value, and its square times Σ f (1 / min(θ, 1) − 1 / θ)"]
            36.0 * unit * inverse, "what air adds, 6 sums, a quotient";
    }
    "pressure/coarsen" {
        COARSE_COEFFICIENT = "coefficients", "": [sum: "its own value"]
            3.0 * U * sum, "a sum of four";
        COARSE_AIR = "what air adds to the diagonal", "": [unit: "U, or 2⁻⁵³ with f64",
            sum: "its own value"]
            8.0 * unit * sum, "a sum of eight";
        COARSE_KIND = "kind of block", "": [] 0.0, "a whole number";
    }
    "pressure/count_pockets" {
        LABELS = "labels of water that no air touches", "": [] 0.0, "the least place of each";
        POCKETS = "pockets", "": [] 0.0, "a count";
    }
    "pressure/sum_pockets" {
        POCKET_SUM = "sums over parts of pockets", "": [unit: "U, or 2⁻⁵³ with f64",
            n: "cells of the part", size: "Σ|x| over it"]
            unit * (n / 256.0 + 9.0) * size, "a thread's cells, and a tree of 8 sums";
    }
    "pressure/center" {
        CENTERED = "values less their mean", "": [unit: "U, or 2⁻⁵³ with f64",
            n: "cells of the pocket", size: "Σ|x| over it", value: "|x|"]
            unit * ((n / 1048576.0 + 36.0) * size / n + value),
            "the mean's error, of parts of 4096 cells, and one difference";
        LEAKED = "flux with what bodies squeeze out", "m/s": [unit: "U, or 2⁻⁵³ with f64",
            largest: "the largest |b|", flux: "its own value"]
            64.0 * unit * largest + 2.0 * U * (largest + flux),
            "a mean of values no larger, rounded to f32, and a sum";
    }
    "pressure/reduce" {
        SCALARS = "sums and what follows", "": [sum: "of a sum " OF_SUM, alpha: "of α " OF_ALPHA,
            beta: "of β " OF_BETA, foreseen: "of the residual after a step " OF_FORESEEN]
            sum + alpha + beta + foreseen, "";
        DECIDED = "state, iterations, restarts", "": [] 0.0, "whole numbers", tie NEAR_TARGET;
    }
    "pressure/precondition" {
        PRECONDITIONED = "correction", "": [unit: "U, or 2⁻⁵³ with f64",
            product: "|r / a|; 0 where it is a copy"]
            unit * product, "a product";
    }
    "pressure/ipp_lower" {
        IPP_LOWER = "first half", "": [unit: "U, or 2⁻⁵³ with f64", d: "the inverse diagonal",
            size: "|r| + Σ|c d r|"]
            9.0 * unit * d * size, "3 products, 4 sums";
    }
    "pressure/ipp_upper" {
        IPP_UPPER = "correction", "": [unit: "U, or 2⁻⁵³ with f64", size: "|y| + d Σ|c y|"]
            9.0 * unit * size, "3 products, 4 sums";
    }
    "pressure/smooth_first" {
        SMOOTHED_FIRST = "correction", "":
            [off: "what the block's solution answers to a right-hand side off by " OF_BLOCK]
            off, "", tie PIVOT;
    }
    "pressure/restrict" {
        RESTRICTED = "residual of the coarser level", "": [error: "" OF_RESTRICTION] error, "";
        SMOOTHED = "correction", "":
            [off: "what the block's solution answers to a right-hand side off by " OF_BLOCK]
            off, "", tie PIVOT;
    }
    "pressure/prolong" {
        PROLONGED = "correction", "":
            [off: "what the block's solution answers to a right-hand side off by " OF_BLOCK]
            off, "", tie PIVOT;
    }
    "pressure/solve_coarse" {
        COARSE_SOLVED = "correction", "":
            [off: "carried on through the blocks after it, the error of each \
                   restriction and, of each block, " OF_BLOCK]
            off, "", tie PIVOT;
        COARSE_RESIDUAL = "residuals of the coarser levels", "":
            [off: "carried on as with the corrections, of each block \
                   and of each restriction " OF_RESTRICTION]
            off, "", tie PIVOT;
    }
    "pressure/advance" {
        DIRECTED = "direction", "": [unit: "U, or 2⁻⁵³ with f64", size: "|z| + |β p|"]
            2.0 * unit * size, "";
        ADVANCED_SOLUTION = "solution, both words", "": [one: "with one word " ONE_WORD,
            two: "with two " TWO_WORDS]
            one + two, "";
        ADVANCED_RESIDUAL = "residual", "": [unit: "U, or 2⁻⁵³ with f64", size: "|r| + |α A p|"]
            2.0 * unit * size, "";
        SMOOTHED_NEXT = "next correction", "":
            [off: "what the block's solution answers to a right-hand side off by " OF_BLOCK]
            off, "", tie PIVOT;
    }
    "pressure/verify" {
        VERIFIED_RESIDUAL = "residual", "": [unit: "U, or 2⁻⁵³ with f64",
            differences: "Σ c |x − x'| of both words", size: "|b| + |A x| of both"]
            unit * (12.0 * differences + 2.0 * size), "";
    }
    "pressure/divergence" {
        RHS = "right-hand side", "m/s": [unit: "U, or 2⁻⁵³ with f64", flow: "Σ|f u|"]
            11.0 * unit * flow, "7 products and sums, and a flux less";
        BEFORE = "largest divergence", "1/s": [flow: "the largest Σ|f u| / Δx",
            most: "its own value"]
            11.0 * U * flow + 4.0 * U * most, "7 products and sums, and a flux less";
    }
    "pressure/multiply" {
        PRODUCT = "system times direction", "m/s": [unit: "U, or 2⁻⁵³ with f64",
            differences: "Σ c |x − x'|", size: "Σ c (|z| + |β p|) of a row and its neighbours"]
            unit * (12.0 * differences + 2.0 * size), "by differences, of a rounded direction";
    }
    "pressure/project" {
        PROJECTED = "velocity at faces", "m/s":
            [words: "of each word of the solution, which may cancel, " OF_DIFFERENCE, v: "|v|"]
            words + 2.0 * U * v, "";
        PRESSURE = "pressure", "Pa": [p: "|p|"] 4.0 * U * p, "";
    }
    "pressure/measure_divergence" {
        AFTER = "largest divergence", "1/s": [flow: "the largest Σ|f u| / Δx",
            most: "its own value"]
            11.0 * U * flow + 4.0 * U * most, "7 products and sums, and a flux less";
    }
    "pressure/density_source" {
        SOURCE = "right-hand side", "m": [b: "|b|"] 2.0 * U * b, "";
    }
    "pressure/displace" {
        DISPLACEMENT = "displacement at faces", "m":
            [words: "of each word of the solution, which may cancel, " OF_DIFFERENCE,
            d: "|the displacement|"]
            words + U * d, "";
    }
    "flip/boundary_work" {
        WORK = "shares of the work", "W/m²": [sizes: "Σ|p f|"]
            66.0 * U * sizes, "64 products and sums";
    }
    "flip/bend_paths" {
        BEND = "weight of the midpoint rule", "": [terms: "the largest Σ|products of slopes| \
            (Δt / Δx)² about, and what is made up for, over what bends paths"]
            U * (60.0 * terms + 4.0), "as of the contraction, and two differences", tie CUT;
    }
    "flip/find_change" {
        CHANGE = "change at faces", "m/s": [size: "|v| + |v before|"] U * size, "one difference";
        LAYER = "layers", "": [] 0.0, "whole numbers";
    }
    "flip/extrapolate" {
        SPREAD_VELOCITY = "velocity at faces", "m/s": [most: "the largest about"]
            12.0 * U * most, "a mean of six and two sums";
        SPREAD_CHANGE = "change at faces", "m/s": [most: "the largest about"]
            12.0 * U * most, "a mean of six and two sums";
        SPREAD_LAYER = "layers", "": [] 0.0, "whole numbers";
    }
    "flip/grid_to_particle" {
        GIVEN = "velocity", "m/s": [velocity: "" OF_FACES, change: "the same of the changes",
            came: "|v| that came in and |g| Δt",
            rubbed: "|g| Δt times the error of solids' distances over a quarter cell"]
            velocity + change + 4.0 * U * came + 2.0 * rubbed,
            "a drop's is their sum; friction turns with the solid's normal and fades with \
             the distance";
        CARRIED = "velocity of the grid", "m/s": [velocity: "" OF_FACES,
            came: "|v| that came in and |g| Δt"]
            velocity + 4.0 * U * came, "the same";
        SHIFT = "displacement", "m": [displacement: "" OF_FACES] displacement, "";
        GIVEN_AFFINE = "affine rows", "1/s": [velocity: "" OF_FACES, size: "Δx"]
            2.0 * velocity / size, "";
    }
    "flip/push_apart" {
        PUSHED = "displacement", "m": [count: "particles that are closer",
            apart: "the distance that is kept",
            period: "the longest of a domain that joins its own end",
            extent: "the domain's longest side", displacement: "its own value"]
            U * (count * (0.25 * (count + 16.0) * apart + 0.5 * period) + 4.0 * apart
                + 2.0 * extent + 2.0 * displacement),
            "a quarter of a difference, a root, a quotient and a product for each, or of a \
             hashed direction, and of their sum; the cap's root and quotient; the walls' places";
    }
    "flip/aim" {
        AIMED = "position", "m": [x: "|x|", way: "Δt (|u| + |v|)", pushed: "what it is pushed by"]
            U * (2.0 * x + 4.0 * way + pushed), "a difference, a product and two sums";
    }
    "flip/advect" {
        MOVED = "position", "m":
            [answer: "what the reference answers when its start moves along each axis by " START,
            x: "|x|, and where a period carried it that four times"]
            answer + U * x, "";
        ADVECTED = "velocity", "m/s":
            [answer: "what the reference answers when its start moves along each axis by " START,
            size: "|v|, with solids |v| that came in and theirs too"]
            answer + 8.0 * U * size, "";
        SLOWED = "particles slowed", "": [answer: "how many more or fewer as starts move by " START]
            answer, "a count";
        MOVED_ID = "id", "": [] 0.0, "a copy";
    }
    "whole projection" {
        RESIDUAL = "‖b − A x‖ / ‖b‖", "": [residual: "" ALLOWED] residual, "";
        SOLUTION = "‖p − p64‖ / ‖p64‖", "": [far: "" FAR,
            least: "the least eigenvalue, by inverse iterations on the direct factor", p: "‖p64‖"]
            relative(far / least, p), "";
        ENERGY = "‖u − u64‖", "m/s": [far: "" FAR, least: "the least eigenvalue"]
            far / least.sqrt(),
            "each face weighted by √(f θ), which is the norm of the pressure's error by the system";
        DIVERGENCE = "‖∇·u‖ after / before", "": [residual: "" ALLOWED, flow: "‖Σ|f u|‖",
            spread: "‖Σ c |x − x'|‖", b: "‖b‖"]
            residual + relative(30.0 * U * (flow + spread), b), "the velocities round too";
    }
    "whole correction" {
        CORRECTION = "‖b − A x‖ / ‖b‖", "": [residual: "" ALLOWED] residual, "";
    }
}
