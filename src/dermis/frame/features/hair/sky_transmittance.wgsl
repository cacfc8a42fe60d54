// Marches from each cell of the grid of strand_sky.wgsl in directions all around, and fits linear functions of direction to the
// transmittances: T(d) = c0 + c . d. Also sums the moments of the light of the environment that passes hair.
//#include "sky_grid.wgsl"
//#include "environment_record.wgsl"

//#fill const DIRECTIONS: u32 = {sky_directions}u; // of `environment.sky`
//#fill const CELLS: u32 = {sky_cells_per_workgroup}; // of a workgroup
const RANDOM_CYLINDER: f32 = 0.7854; // mean extinction of a cylinder in all orientations, relative to its length times width

var<workgroup> of_hair: array<array<vec4f, DIRECTIONS>, CELLS>;
var<workgroup> of_all: array<array<vec4f, DIRECTIONS>, CELLS>;
var<workgroup> of_sky: array<array<SkyMoments, DIRECTIONS>, CELLS>;

// Transmittance past hair alone, and past hair and head.
fn march(grid: SkyGrid, cell: vec3u, direction: vec3f) -> vec2f {
    let step_mm = min(grid.cell.x, min(grid.cell.y, grid.cell.z));
    let absorption = RANDOM_CYLINDER * hairs.absorptance / (AREA_SCALE * grid.cell.x * grid.cell.y * grid.cell.z);
    let forward = step_mm * direction / grid.cell;
    var at = vec3f(cell) + 0.5;
    var depth = 0.0;
    var open = 1.0;
    var part = 0.5; // of the first step, from the middle of the cell
    var k = 0u;
    loop {
        if (!in_grid(at)) {
            break;
        }
        let content = atomicLoad(&opacity[content_word(sky_cell_index(vec3u(at)))]);
        depth += part * step_mm * absorption * f32(content & ~HEAD_FLAG);
        if (k > 1u && (content & HEAD_FLAG) != 0u) {
            open = 0.0;
        }
        part = 1.0;
        at += forward;
        k++;
    }
    let passing = exp(-depth);
    return vec2f(passing, open * passing);
}

@compute @workgroup_size(DIRECTIONS, CELLS)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_id) id: vec3u) {
    let index = (group.y * groups.x + group.x) * CELLS + id.y;
    let grid = sky_grid();
    let cell = vec3u(index % SKY_CELLS.x, index / SKY_CELLS.x % SKY_CELLS.y, index / (SKY_CELLS.x * SKY_CELLS.y));
    let inside = index < sky_cell_count() && all(grid.cell > vec3f(0.0));
    var passing = vec2f(1.0);
    let direction = environment.sky[id.x].xyz;
    if (inside) {
        passing = march(grid, cell, direction);
    }
    of_hair[id.y][id.x] = passing.x * vec4f(3.0 * direction, 1.0);
    of_all[id.y][id.x] = passing.y * vec4f(3.0 * direction, 1.0);
    of_sky[id.y][id.x] = sky_moments(direction, passing.x * environment.sky[id.x].w);
    for (var offset = DIRECTIONS / 2u; offset > 0u; offset /= 2u) {
        workgroupBarrier();
        if (id.x < offset) {
            of_hair[id.y][id.x] += of_hair[id.y][id.x + offset];
            of_all[id.y][id.x] += of_all[id.y][id.x + offset];
            of_sky[id.y][id.x] = sum_of(of_sky[id.y][id.x], of_sky[id.y][id.x + offset]);
        }
    }
    workgroupBarrier();
    if (inside && id.x == 0u) {
        let word = transmittance_word(index);
        let hair = of_hair[id.y][0] / f32(DIRECTIONS);
        let head_and_hair = of_all[id.y][0] / f32(DIRECTIONS);
        atomicStore(&opacity[word], pack2x16float(hair.xy));
        atomicStore(&opacity[word + 1u], pack2x16float(hair.zw));
        atomicStore(&opacity[word + 2u], pack2x16float(head_and_hair.xy));
        atomicStore(&opacity[word + 3u], pack2x16float(head_and_hair.zw));
        let sky = of_sky[id.y][0];
        atomicStore(&opacity[word + 4u], pack2x16float(sky.first.xy));
        atomicStore(&opacity[word + 5u], pack2x16float(sky.first.zw));
        atomicStore(&opacity[word + 6u], pack2x16float(sky.squares.xy));
        atomicStore(&opacity[word + 7u], pack2x16float(vec2f(sky.squares.z, sky.mixed.x)));
        atomicStore(&opacity[word + 8u], pack2x16float(sky.mixed.yz));
    }
}
