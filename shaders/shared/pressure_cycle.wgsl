// The parts of a V-cycle on one level, for one block.
//
// Two-colour Gauss-Seidel over 2³ blocks that are solved exactly, which smooths better than
// Gauss-Seidel over cells and loads less. A coarse cell corresponds to a block: residuals are
// summed into it, and its value is added to all eight cells. The coarse coefficients
// (pressure/coarsen) are half of the Galerkin ones, which compensates for this piecewise-constant
// transfer.
//
// Where a workgroup has one brick, it takes the latest values within the brick, but around it those
// from before the pass: on the way down 0, on the way up the first smoothing plus the coarse
// correction. Down the first colour comes first, up the second, so that the cycle is symmetric. The
// smoother M of the system A converges, because M + Mᵀ − A is diagonally dominant. Compared with a
// smoother that sees across bricks it costs no iteration, or one in ten, and one dispatch instead
// of three.
#import "shared/pressure_links.wgsl"

@group(0) @binding(5) var<storage, read_write> pressure_residual: array<real>;
// The correction, and after it that of the first smoothing of levels with dispatches of their own.
@group(0) @binding(6) var<storage, read_write> pressure_correction: array<real>;

fn residual_at(s: Site) -> Pair {
    let own = blocked(s.slot, s.block);
    return Pair(
        vec4r(
            pressure_residual[own],
            pressure_residual[own + 64u],
            pressure_residual[own + 128u],
            pressure_residual[own + 192u],
        ),
        vec4r(
            pressure_residual[own + 256u],
            pressure_residual[own + 320u],
            pressure_residual[own + 384u],
            pressure_residual[own + 448u],
        ),
    );
}

fn corrections(first: u32, s: u32, t: u32) -> vec4r {
    return vec4r(
        pressure_correction[first],
        pressure_correction[first + s],
        pressure_correction[first + t],
        pressure_correction[first + s + t],
    );
}

// Corrections around a block. `lower` and `upper` are offsets for each side, such as that of the
// first smoothing.
fn corrections_at(s: Site, lower: vec3u, upper: vec3u) -> Sides {
    let l = lower + blocked_lower(s);
    let u = upper + blocked_upper(s);
    return Sides(
        corrections(l.x + 64u, 128u, 256u),
        corrections(u.x, 128u, 256u),
        corrections(l.y + 128u, 64u, 256u),
        corrections(u.y, 64u, 256u),
        corrections(l.z + 256u, 64u, 128u),
        corrections(u.z, 64u, 128u),
    );
}

fn corrections_about(s: Site) -> Sides {
    return corrections_at(s, vec3u(0u), vec3u(0u));
}

// What the first smoothing left around a block.
fn smoothed_about(s: Site) -> Sides {
    return corrections_at(s, vec3u(phase.stride), vec3u(phase.stride));
}

// The block with 0 in place of what is around it in other bricks.
fn alone(s: Site) -> Site {
    var kept = s;
    kept.lower_slot = select(vec3u(0u), s.lower_slot, s.lower_slot == vec3u(s.slot));
    kept.upper_slot = select(vec3u(0u), s.upper_slot, s.upper_slot == vec3u(s.slot));
    return kept;
}

fn store_correction(first: u32, z: Pair) {
    for (var c = 0u; c < 4u; c++) {
        pressure_correction[first + 64u * c] = z.lo[c];
        pressure_correction[first + 64u * c + 256u] = z.hi[c];
    }
}

// Inflow from the values around the block.
fn inflow(l: Links, v: Sides) -> Pair {
    return sum_sides(Sides(
        l.out.xl * v.xl,
        l.out.xu * v.xu,
        l.out.yl * v.yl,
        l.out.yu * v.yu,
        l.out.zl * v.zl,
        l.out.zu * v.zu,
    ));
}

// 1 / pivot; 0 if there is no row, or if only rounding is left of the pivot of a closed pair.
fn inverse(pivot: real, diagonal: real) -> real {
    return select(0.0, 1.0 / pivot, pivot > 1e-5 * diagonal);
}

// The block's exact solution for fixed values around it: cells 0, 3, 5 and 6, which do not touch
// one another, are eliminated; the other four are solved by an L D Lᵀ factorisation.
fn solve_block(l: Links, rhs: Pair) -> Pair {
    let d = diagonal(l);
    let red = vec4r(rhs.lo.x, rhs.lo.w, rhs.hi.y, rhs.hi.z);
    let red_diagonal = vec4r(d.lo.x, d.lo.w, d.hi.y, d.hi.z);
    let w = select(vec4r(0.0), 1.0 / red_diagonal, red_diagonal > vec4r(0.0));
    // Columns: couplings of cells 1, 2, 4 and 7 with the eliminated four.
    let c1 = vec4r(l.ix.x, l.iy.y, l.iz.y, 0.0);
    let c2 = vec4r(l.iy.x, l.ix.y, 0.0, l.iz.z);
    let c4 = vec4r(l.iz.x, 0.0, l.ix.z, l.iy.z);
    let c7 = vec4r(0.0, l.iz.w, l.iy.w, l.ix.w);
    let w1 = w * c1;
    let w2 = w * c2;
    let w4 = w * c4;
    let wr = w * red;
    let b1 = rhs.lo.y + dot(c1, wr);
    let p1 = inverse(d.lo.y - dot(w1, c1), d.lo.y);
    let s12 = -dot(w1, c2);
    let s14 = -dot(w1, c4);
    let s17 = -dot(w1, c7);
    let l12 = p1 * s12;
    let l14 = p1 * s14;
    let l17 = p1 * s17;
    let b2 = rhs.lo.z + dot(c2, wr) - l12 * b1;
    let p2 = inverse(d.lo.z - dot(w2, c2) - l12 * s12, d.lo.z);
    let s24 = -dot(w2, c4) - l12 * s14;
    let s27 = -dot(w2, c7) - l12 * s17;
    let l24 = p2 * s24;
    let l27 = p2 * s27;
    let b4 = rhs.hi.x + dot(c4, wr) - l14 * b1 - l24 * b2;
    let p4 = inverse(d.hi.x - dot(w4, c4) - l14 * s14 - l24 * s24, d.hi.x);
    let s47 = -dot(w4, c7) - l14 * s17 - l24 * s27;
    let l47 = p4 * s47;
    let b7 = rhs.hi.w + dot(c7, wr) - l17 * b1 - l27 * b2 - l47 * b4;
    let p7 = inverse(d.hi.w - dot(w * c7, c7) - l17 * s17 - l27 * s27 - l47 * s47, d.hi.w);
    let z7 = p7 * b7;
    let z4 = p4 * b4 - l47 * z7;
    let z2 = p2 * b2 - l24 * z4 - l27 * z7;
    let z1 = p1 * b1 - l12 * z2 - l14 * z4 - l17 * z7;
    let z = wr + w * (c1 * z1 + c2 * z2 + c4 * z4 + c7 * z7);
    return Pair(vec4r(z.x, z1, z2, z.y), vec4r(z4, z.z, z.w, z7));
}

// Smooths the first colour, with all other values still 0.
fn smooth_first_at(s: Site) {
    store_correction(blocked(s.slot, s.block), solve_block(links_at(s), residual_at(s)));
}

// The block's solution for given values around it.
fn solve_about(l: Links, r: Pair, about: Sides) -> Pair {
    let flow = inflow(l, about);
    return solve_block(l, Pair(r.lo + flow.lo, r.hi + flow.hi));
}

// Smooths one colour from the latest values of the other; returns the block's share of residual ·
// correction.
fn smooth_at(s: Site) -> real {
    let r = residual_at(s);
    let z = solve_about(links_at(s), r, corrections_about(s));
    store_correction(blocked(s.slot, s.block), z);
    return dot_pair(r, z);
}

// Smooths a brick from a correction of 0, one thread per block, both colours in turn.
fn smooth_brick(s: Site, colour: u32, r: Pair, is_on: bool) {
    let own = phase.stride + blocked(s.slot, s.block);
    if is_on && colour == 0u {
        store_correction(own, solve_block(links_at(s), r));
    }
    storageBarrier();
    if is_on && colour == 1u {
        store_correction(own, solve_about(links_at(s), r, smoothed_about(alone(s))));
    }
}

// Values of the coarse cells above the blocks around this one.
struct Above {
    lower: vec3r,
    upper: vec3r,
}

fn above_about(s: Site) -> Above {
    // Along each axis one of the two lies in the own brick.
    let own = pressure_bricks[s.slot].above;
    let far_slot = select(s.lower_slot, s.upper_slot, s.lower_slot == vec3u(s.slot));
    let far = vec3u(
        pressure_bricks[far_slot.x].above,
        pressure_bricks[far_slot.y].above,
        pressure_bricks[far_slot.z].above,
    );
    let lower = select(far, vec3u(own), s.lower_slot == vec3u(s.slot));
    let upper = select(far, vec3u(own), s.upper_slot == vec3u(s.slot));
    return Above(
        vec3r(
            pressure_correction[lower.x + above_offset(s.lower_block.x)],
            pressure_correction[lower.y + above_offset(s.lower_block.y)],
            pressure_correction[lower.z + above_offset(s.lower_block.z)],
        ),
        vec3r(
            pressure_correction[upper.x + above_offset(s.upper_block.x)],
            pressure_correction[upper.y + above_offset(s.upper_block.y)],
            pressure_correction[upper.z + above_offset(s.upper_block.z)],
        ),
    );
}

// Adds the coarse values above the blocks around a block.
fn with_above(about: Sides, above: Above) -> Sides {
    return Sides(
        about.xl + above.lower.x,
        about.xu + above.upper.x,
        about.yl + above.lower.y,
        about.yu + above.upper.y,
        about.zl + above.lower.z,
        about.zu + above.upper.z,
    );
}

// Smooths the second colour after the coarser level's solve: the first colour's values have the
// coarse values above them added.
fn smooth_corrected_at(s: Site) -> real {
    let r = residual_at(s);
    let about = with_above(corrections_about(s), above_about(s));
    let z = solve_about(links_at(s), r, about);
    store_correction(blocked(s.slot, s.block), z);
    return dot_pair(r, z);
}

// The same where a workgroup has one brick; then, in the second step, the first colour, which takes
// the new values of its own brick.
fn prolong_at(s: Site, is_second: bool) -> real {
    let r = residual_at(s);
    let is_new_lower = (s.lower_slot == vec3u(s.slot)) & vec3<bool>(is_second);
    let is_new_upper = (s.upper_slot == vec3u(s.slot)) & vec3<bool>(is_second);
    let smoothed = vec3u(phase.stride);
    let left = corrections_at(s, select(smoothed, vec3u(0u), is_new_lower),
        select(smoothed, vec3u(0u), is_new_upper));
    let above = above_about(s);
    let about = with_above(left, Above(
        select(above.lower, vec3r(0.0), is_new_lower),
        select(above.upper, vec3r(0.0), is_new_upper),
    ));
    let z = solve_about(links_at(s), r, about);
    store_correction(blocked(s.slot, s.block), z);
    return dot_pair(r, z);
}

// What a block of the first colour passes down after the first smoothing: half of the sum of its
// residuals. It was solved with 0 around it, so that is the inflow since then.
fn passed_by_first(s: Site) -> real {
    return 0.5 * sum_pair(inflow(links_at(s), smoothed_about(s)));
}

// The same for the second colour, which was solved with the values of its own brick around it: the
// inflow from other bricks, at most one along each axis.
fn passed_by_second(s: Site) -> real {
    let l = links_at(s);
    let is_lower = s.lower_slot != vec3u(s.slot);
    let beside = select(s.upper_slot, s.lower_slot, is_lower);
    let block = select(s.upper_block, s.lower_block, is_lower);
    let slot = select(beside, vec3u(0u), beside == vec3u(s.slot));
    let at = phase.stride + 512u * slot + block + select(vec3u(0u), BLOCKED, is_lower);
    let x = dot(select(l.out.xu, l.out.xl, is_lower.x), corrections(at.x, 128u, 256u));
    let y = dot(select(l.out.yu, l.out.yl, is_lower.y), corrections(at.y, 64u, 256u));
    let z = dot(select(l.out.zu, l.out.zl, is_lower.z), corrections(at.z, 64u, 128u));
    return 0.5 * (x + y + z);
}

// Restricts the residual of a first-colour block after the second colour's sweep, summed into the
// cell above. The block was solved with 0 around it, so its residual is the inflow since then; the
// second colour, solved last, has a residual of 0.
fn restrict_at(s: Site) {
    let flow = inflow(links_at(s), corrections_about(s));
    let above = pressure_bricks[s.slot].above;
    pressure_residual[above + above_offset(s.block)] = 0.5 * sum_pair(flow);
    pressure_residual[above + above_offset(s.block ^ 1u)] = 0.0;
}
