// What of each cell and of its lower faces is open, and what the solids push through the rest: face fractions of
// Batty et al. 2007, exact for the walls and for planes in meshes.
#import "shared/thread.wgsl"
#import "shared/flip_params.wgsl"
#import "shared/bricks.wgsl"
#import "shared/flip_walls.wgsl"
#ifdef SOLIDS
#import "shared/flip_solid.wgsl"
#import "shared/flip_cut.wgsl"
#endif

@group(0) @binding(1) var<storage, read> bricks: array<Brick>;
@group(0) @binding(2) var<storage, read> cell_start: array<u32>;
@group(0) @binding(3) var<storage, read_write> cell_kind: array<u32>;
@group(0) @binding(4) var<storage, read_write> face_open: array<f32>;
@group(0) @binding(5) var<storage, read_write> solid_flux: array<f32>;
#ifdef SOLIDS
@group(0) @binding(6) var<storage, read_write> open_volume: array<f32>;
#endif

const AIR = 0u;
const FLUID = 1u;
const SOLID = 2u;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let thread = thread_index(workgroup, workgroups, local, 64u);
    if thread >= params.active_cells {
        return;
    }
    let element = thread + CELLS;
    let slot = element / CELLS;
    let brick = vec3u(bricks[slot].coordinate[0], bricks[slot].coordinate[1], bricks[slot].coordinate[2]);
    let cell = vec3f(8u * brick + local_cell(element % CELLS));
    let extent = open_extent(cell);
    let across = extent.yzx * extent.zxy;
    var lower = select(vec3f(0.0), across, is_plane_open(cell));
    var upper = select(vec3f(0.0), across, is_plane_open(cell + 1.0));
    var volume = extent.x * across.x;
#ifdef SOLIDS
    let size = params.cell_size;
    let middle = (cell + 0.5) * size;
    let is_near = solid_distance_near(middle) < 2.0 * (size + solid_grid.spacing);
    // Entered only where a solid may cut the cell.
    for (var once = 0; once < select(0, 1, is_near); once++) {
        let x = vec2f(cell.x, cell.x + 1.0) * size;
        let y = vec2f(cell.y, cell.y + 1.0) * size;
        let z = vec2f(cell.z, cell.z + 1.0) * size;
        // On a face counts as inside.
        let skin = 1e-4 * size;
        let near = vec4f(
            solid_distance_at(vec3f(x.x, y.x, z.x)),
            solid_distance_at(vec3f(x.y, y.x, z.x)),
            solid_distance_at(vec3f(x.x, y.y, z.x)),
            solid_distance_at(vec3f(x.y, y.y, z.x)),
        ) - skin;
        let far = vec4f(
            solid_distance_at(vec3f(x.x, y.x, z.y)),
            solid_distance_at(vec3f(x.y, y.x, z.y)),
            solid_distance_at(vec3f(x.x, y.y, z.y)),
            solid_distance_at(vec3f(x.y, y.y, z.y)),
        ) - skin;
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
        let slopes = abs(vec3f(
            dot(near.yw + far.yw - near.xz - far.xz, vec2f(0.25)),
            dot(near.zw + far.zw - near.xy - far.xy, vec2f(0.25)),
            dot(far - near, vec4f(0.25)),
        ));
        let center = dot(near + far, vec4f(0.125));
        volume *= clamp(0.5 + center / max(slopes.x + slopes.y + slopes.z, 1e-20), 0.0, 1.0);
    }
    lower = select(lower, vec3f(0.0), lower < vec3f(ON_FACE));
    upper = select(upper, vec3f(0.0), upper < vec3f(ON_FACE));
    open_volume[element] = volume;
#endif
    let is_open = volume >= ON_FACE * ON_FACE || any(lower + upper > vec3f(0.0));
    var count = 0u;
    if thread < params.wet_cells {
        count = cell_start[element + 1u] - cell_start[element];
    }
    cell_kind[element] = select(SOLID, select(AIR, FLUID, count > 0u), is_open);
    face_open[element] = lower.x;
    face_open[params.stride + element] = lower.y;
    face_open[2u * params.stride + element] = lower.z;
    let pushed = (1.0 - upper) * wall_velocity(cell + 1.0) - (1.0 - lower) * wall_velocity(cell);
    solid_flux[element] = pushed.x + pushed.y + pushed.z;
}
