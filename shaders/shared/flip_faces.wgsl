// Open areas of a cell's faces beside walls and solids: face fractions of Batty et al. 2007, exact
// for walls and for planes in meshes. Which of several solids are looked at, `solids_about` and
// `solid_about` say: shared/all_solids.wgsl or shared/brick_solids.wgsl.
#import "shared/flip_walls.wgsl"
#import "shared/flip_cut.wgsl"
#import "shared/flip_solid.wgsl"

// A face with a smaller open fraction is closed: such faces drive jets at edges and corners in
// water at rest. A larger threshold blocks the flow along a wall: with 0.3, the deviation from
// Lamb's solution for water in a turning elliptic drum is 3.6 times as large.
const LEAST_OPEN = 0.02;

struct CutFaces {
    // Open areas of the lower and upper faces, beside walls alone and beside solids as well.
    lower_of_walls: vec3f,
    upper_of_walls: vec3f,
    lower: vec3f,
    upper: vec3f,
    // Distances at the cell's corners, and the bit k % 32 for each solid k that may cut the cell.
    corners: Corners,
    solids: u32,
#ifdef MOVING_SOLIDS
    // Velocity of the solid nearest to each face, along that face's axis.
    lower_velocity: vec3f,
    upper_velocity: vec3f,
#endif
#ifdef BODIES
    // Number of that solid.
    lower_solid: vec3u,
    upper_solid: vec3u,
#endif
}

fn cut_faces(cell: vec3f, across: vec3f) -> CutFaces {
    var cut: CutFaces;
    cut.lower_of_walls = select(vec3f(0.0), across, is_plane_open(cell));
    cut.upper_of_walls = select(vec3f(0.0), across, is_plane_open(cell + 1.0));
    var lower = cut.lower_of_walls;
    var upper = cut.upper_of_walls;
    var corners = Corners(vec4f(1e15), vec4f(1e15));
    var solids = 0u;
#ifdef MOVING_SOLIDS
    for (var about = 0u; about < solids_about(); about++) {
        let k = solid_about(about);
        for (var once = 0; once < select(0, 1, may_cut_by(k, cell)); once++) {
            let found = corner_distances(cell);
            let is_nearer_low = lower_sums(found) < lower_sums(corners);
            let is_nearer_high = upper_sums(found) < upper_sums(corners);
            // A velocity component of a rigid body does not change along its own axis: the value at
            // the centre is that at both faces. Where the shape changes, it is that of the surface
            // in the cell, and the flux is the surface's area times it: between the two faces the
            // velocity near a surface also changes where nothing crosses it.
            let pushing = solid_velocity_at((cell + 0.5) * params.cell_size);
            cut.lower_velocity = select(cut.lower_velocity, pushing, is_nearer_low);
            cut.upper_velocity = select(cut.upper_velocity, pushing, is_nearer_high);
#ifdef BODIES
            cut.lower_solid = select(cut.lower_solid, vec3u(k), is_nearer_low);
            cut.upper_solid = select(cut.upper_solid, vec3u(k), is_nearer_high);
#endif
            corners = Corners(min(corners.near, found.near), min(corners.far, found.far));
            solids |= 1u << (k % 32u);
        }
    }
#else
    // Only cells that a solid may cut enter the loop.
    for (var once = 0; once < select(0, 1, may_cut(cell)); once++) {
        corners = corner_distances(cell);
        solids = 1u;
    }
#endif
    for (var once = 0; once < select(0, 1, solids != 0u); once++) {
        let near = corners.near;
        let far = corners.far;
        lower *= vec3f(
            open_part(vec4f(near.xz, far.xz)),
            open_part(vec4f(near.xy, far.xy)),
            open_part(near),
        );
        upper *= vec3f(
            open_part(vec4f(near.yw, far.yw)),
            open_part(vec4f(near.zw, far.zw)),
            open_part(far),
        );
        lower = select(lower, vec3f(0.0), lower < LEAST_OPEN * across);
        upper = select(upper, vec3f(0.0), upper < LEAST_OPEN * across);
    }
    cut.lower = select(lower, vec3f(0.0), lower < vec3f(ON_FACE));
    cut.upper = select(upper, vec3f(0.0), upper < vec3f(ON_FACE));
    cut.corners = corners;
    cut.solids = solids;
    return cut;
}
