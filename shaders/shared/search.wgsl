// Calls the importing pass's visit(i, j) for every particle and boundary sample j in the 27 cells
// around xi, except for i itself. Hoetzlein 2014: nine runs of three cells.
@group(0) @binding(2) var<storage, read> cell_start: array<u32>;
#ifdef SOLIDS
@group(0) @binding(3) var<storage, read> boundary_cell_start: array<u32>;
#endif

fn search_neighbors(xi: vec3f, i: u32) {
    let dims = vec3i(params.grid_dims);
    let centre = cell_coordinate(xi);
    let low = max(centre - 1, vec3i(0));
    let high = min(centre + 1, dims - 1);
#ifdef PERIODIC
    for (var k = 0; k < 27; k++) {
        var cell: vec3i;
        if cell_about(centre, k, &cell) {
            let first = cell_index(cell);
            let last = first + 1u;
#else
    for (var z = low.z; z <= high.z; z++) {
        for (var y = low.y; y <= high.y; y++) {
            let row = (z * dims.y + y) * dims.x;
            let first = u32(row + low.x);
            let last = u32(row + high.x) + 1u;
#endif
            let end = cell_start[last];
            for (var j = cell_start[first]; j < end; j++) {
                if j != i {
                    visit(i, j);
                }
            }
#ifdef SOLIDS
            let boundary_end = boundary_cell_start[last];
            for (var b = boundary_cell_start[first]; b < boundary_end; b++) {
                visit(i, fluid_count + b);
            }
#endif
        }
    }
}
