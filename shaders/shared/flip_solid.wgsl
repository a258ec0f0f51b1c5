// Trilinear signed distance of the solids, metres, in general and at the corners of a cell.
#import "shared/confine.wgsl"

// Interpolated distance. Where the nearest node is far from the surface (see may_cut), no
// interpolation is needed.
fn solid_distance_at(x: vec3f) -> f32 {
    let p = clamp(
        from_first_node(x) / solid_grid.spacing, vec3f(0.0), vec3f(solid_grid.dims - 1u) - 1e-3);
    let node = vec3u(p);
    let t = p - vec3f(node);
    let low = mix(
        mix(solid_node(node), solid_node(node + vec3u(1, 0, 0)), t.x),
        mix(solid_node(node + vec3u(0, 1, 0)), solid_node(node + vec3u(1, 1, 0)), t.x),
        t.y,
    );
    let high = mix(
        mix(solid_node(node + vec3u(0, 0, 1)), solid_node(node + vec3u(1, 0, 1)), t.x),
        mix(solid_node(node + vec3u(0, 1, 1)), solid_node(node + vec3u(1, 1, 1)), t.x),
        t.y,
    );
    return mix(low, high, t.z);
}

// Distance at the nearest node, as a first test; far away outside the grid.
fn solid_distance_near(x: vec3f) -> f32 {
    let p = from_first_node(x) / solid_grid.spacing;
    let is_outside = any(p < vec3f(-1.0)) || any(p > vec3f(solid_grid.dims));
    let node = vec3u(clamp(p + 0.5, vec3f(0.0), vec3f(solid_grid.dims - 1u)));
    return select(solid_node(node), 1e15, is_outside);
}

// First test: the distance at the nearest node, or beyond the grid the distance to the grid, since
// solids lie within it.
fn solid_distance_bound(x: vec3f) -> f32 {
    let place = from_first_node(x);
    let way = distance(
        place, clamp(place, vec3f(0.0), solid_grid.spacing * vec3f(solid_grid.dims - 1u)));
    return select(solid_distance_near(x), way, way > 0.0);
}

// At the lower and at the upper z, each in the order (x, y) = (0,0), (1,0), (0,1), (1,1).
struct Corners {
    near: vec4f,
    far: vec4f,
}

// Whether a solid comes close enough to a cell to cut it.
fn may_cut(cell: vec3f) -> bool {
    let middle = (cell + 0.5) * params.cell_size;
    return solid_distance_near(middle) < 2.0 * (params.cell_size + solid_grid.spacing);
}

#ifdef MOVING_SOLIDS
// Whether solid k does at the substep's start; selects it if it may.
fn may_cut_by(k: u32, cell: vec3f) -> bool {
    // A node beyond the grid still counts as near, in any direction.
    let beyond = 2.0 * posed_solids.solids[k].grid.spacing;
    if !may_be_at_solid(k, 0.0, (cell + 0.5) * params.cell_size, beyond) {
        return false;
    }
    look_at_solid(k, 0.0);
    return may_cut(cell);
}

#endif
// Distance at a corner of cells, at `x` in cells. A corner on the surface counts as inside.
fn corner_distance(x: vec3f) -> f32 {
    return solid_distance_at(params.cell_size * x) - 1e-4 * params.cell_size;
}

fn corner_distances(cell: vec3f) -> Corners {
    let near = vec4f(
        corner_distance(cell),
        corner_distance(cell + vec3f(1.0, 0.0, 0.0)),
        corner_distance(cell + vec3f(0.0, 1.0, 0.0)),
        corner_distance(cell + vec3f(1.0, 1.0, 0.0)),
    );
    let far = vec4f(
        corner_distance(cell + vec3f(0.0, 0.0, 1.0)),
        corner_distance(cell + vec3f(1.0, 0.0, 1.0)),
        corner_distance(cell + vec3f(0.0, 1.0, 1.0)),
        corner_distance(cell + vec3f(1.0, 1.0, 1.0)),
    );
    return Corners(near, far);
}

// Sums over the corners of each lower face, and of each upper face.
fn lower_sums(c: Corners) -> vec3f {
    let both = c.near + c.far;
    return vec3f(both.x + both.z, both.x + both.y, dot(c.near, vec4f(1.0)));
}

fn upper_sums(c: Corners) -> vec3f {
    let both = c.near + c.far;
    return vec3f(both.y + both.w, both.z + both.w, dot(c.far, vec4f(1.0)));
}
