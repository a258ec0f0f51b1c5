// The cells around a cell for surface tension: a wall or solid has the water fraction of the cell
// in front of it, as in a mirror, so that the surface meets walls at 90 degrees.
#import "shared/thread.wgsl"
#import "shared/flip_params.wgsl"
#import "shared/flip_neighborhood.wgsl"
#ifdef PERIODIC
#import "shared/flip_periodic.wgsl"
#endif

@group(0) @binding(2) var<storage, read> cell_kind: array<u32>;

const SOLID = 2u;

var<private> is_closed_before: vec3<bool>;
var<private> is_closed_after: vec3<bool>;

fn is_closed(cell: vec3i, step: vec3i) -> bool {
    let there = cell + step;
    var is_beyond = (there < vec3i(0)) | (there >= vec3i(params.cells));
#ifdef PERIODIC
    is_beyond &= !is_periodic();
#endif
    let other = element_at(step);
    return any(is_beyond) || (other >= CELLS && cell_kind[other] == SOLID);
}

fn open_mirrored(element: u32) {
    open_neighborhood(element);
    let cell = vec3i(own_cell(element));
    for (var axis = 0u; axis < 3u; axis++) {
        var step = vec3i(0);
        step[axis] = 1;
        is_closed_before[axis] = is_closed(cell, -step);
        is_closed_after[axis] = is_closed(cell, step);
    }
}

// Element of the cell at `offset`, or of the cell that it mirrors.
fn mirrored_element(offset: vec3i) -> u32 {
    let is_behind = ((offset < vec3i(0)) & is_closed_before)
        | ((offset > vec3i(0)) & is_closed_after);
    let found = element_at(select(offset, vec3i(0), is_behind));
    let is_solid = found >= CELLS && cell_kind[found] == SOLID;
    return select(found, element_at(vec3i(0)), is_solid);
}
