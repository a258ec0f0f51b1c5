// The system's rows, one block at a time.
#import "shared/pressure_site.wgsl"

// Coefficients of the lower faces, three planes; air's contribution to the diagonal; and for each
// block its kind, with one bit per row from bit 8 on.
@group(0) @binding(2) var<storage, read> pressure_coefficient: array<f32>;
@group(0) @binding(3) var<storage, read> pressure_dirichlet: array<real>;
@group(0) @binding(4) var<storage, read> pressure_block: array<u32>;

// EMPTY: no row; FULL: every coefficient is 1 and there is no air; MIXED: anything else.
const EMPTY = 0u;
const FULL = 1u;
const MIXED = 2u;

struct Links {
    // Within the block: across x (cells 0-1, 2-3, 4-5, 6-7), y (0-2, 1-3, 4-6, 5-7), z (0-4, 1-5,
    // 2-6, 3-7).
    ix: vec4r,
    iy: vec4r,
    iz: vec4r,
    out: Sides,
    dirichlet: Pair,
}

fn coefficients(first: u32, s: u32, t: u32) -> vec4r {
    return vec4r(vec4f(
        pressure_coefficient[first],
        pressure_coefficient[first + s],
        pressure_coefficient[first + t],
        pressure_coefficient[first + s + t],
    ));
}

fn links_at(s: Site) -> Links {
    let kind = pressure_block[64u * s.slot + s.block] & 3u;
    let one = vec4r(real(select(0.0, 1.0, kind == FULL)));
    let none = Pair(vec4r(0.0), vec4r(0.0));
    var l = Links(one, one, one, Sides(one, one, one, one, one, one), none);
    // A loop instead of a branch: software devices run both sides of a branch but skip a loop that
    // no lane is in, and most blocks are FULL.
    for (var once = u32(kind == MIXED); once > 0u; once -= 1u) {
        let own = blocked(s.slot, s.block);
        let upper = blocked_upper(s);
        let y = phase.stride;
        let z = 2u * phase.stride;
        l.out.xl = coefficients(own, 128u, 256u);
        l.ix = coefficients(own + 64u, 128u, 256u);
        l.out.xu = coefficients(upper.x, 128u, 256u);
        l.out.yl = coefficients(y + own, 64u, 256u);
        l.iy = coefficients(y + own + 128u, 64u, 256u);
        l.out.yu = coefficients(y + upper.y, 64u, 256u);
        l.out.zl = coefficients(z + own, 64u, 128u);
        l.iz = coefficients(z + own + 256u, 64u, 128u);
        l.out.zu = coefficients(z + upper.z, 64u, 128u);
        for (var c = 0u; c < 4u; c++) {
            l.dirichlet.lo[c] = pressure_dirichlet[own + 64u * c];
            l.dirichlet.hi[c] = pressure_dirichlet[own + 64u * c + 256u];
        }
    }
    return l;
}

// Σ a (x − x') + dirichlet x, from differences: for smooth x the rounding error is that of the
// differences, not that of x.
fn apply(l: Links, own: Pair, out: Sides) -> Pair {
    let at = sides_of(own);
    let x = l.ix * (at.xu - at.xl);
    let y = l.iy * (at.yu - at.yl);
    let z = l.iz * (at.zu - at.zl);
    let sum = sum_sides(Sides(
        l.out.xl * (at.xl - out.xl) - x,
        l.out.xu * (at.xu - out.xu) + x,
        l.out.yl * (at.yl - out.yl) - y,
        l.out.yu * (at.yu - out.yu) + y,
        l.out.zl * (at.zl - out.zl) - z,
        l.out.zu * (at.zu - out.zu) + z,
    ));
    return Pair(sum.lo + l.dirichlet.lo * own.lo, sum.hi + l.dirichlet.hi * own.hi);
}

fn diagonal(l: Links) -> Pair {
    let sum = sum_sides(Sides(
        l.out.xl + l.ix,
        l.out.xu + l.ix,
        l.out.yl + l.iy,
        l.out.yu + l.iy,
        l.out.zl + l.iz,
        l.out.zu + l.iz,
    ));
    return Pair(sum.lo + l.dirichlet.lo, sum.hi + l.dirichlet.hi);
}

fn sum_pair(p: Pair) -> real {
    let s = p.lo + p.hi;
    return (s.x + s.y) + (s.z + s.w);
}

fn dot_pair(a: Pair, b: Pair) -> real {
    return sum_pair(Pair(a.lo * b.lo, a.hi * b.hi));
}
