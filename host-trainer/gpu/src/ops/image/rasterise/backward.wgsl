// Front to back, as forward: dL/dα_i = T_i·(c_i·g) − rest_i/(1 − α_i), and rest, what of g·C has not been blended yet, shrinks.
//
// Four splats at a time: every pixel leaves its share of dL/d(power) and its weight in shared memory, then a thread adds up a column of
// one splat, then a thread adds up the columns of one number of one splat. The order of every sum is fixed. Threads that read at once read
// from different banks: neighbours stand in neighbouring columns, and begin at different rows or columns where they would meet.

@group(0) @binding(0) var<storage, read> splats: array<Splat>;
@group(0) @binding(1) var<storage, read> starts: array<u32>;
@group(0) @binding(2) var<storage, read> entries: array<u32>;
@group(0) @binding(3) var<storage, read> slot_of_pair: array<u32>;
@group(0) @binding(4) var<storage, read> image: array<f32>;
// [3, height, width].
@group(0) @binding(5) var<storage, read> d_image: array<f32>;
// [pairs, 9], in the order of slot_of_pair.
@group(0) @binding(6) var<storage, read_write> d_pairs: array<f32>;

const AT_ONCE: u32 = 4u;
const N_NUMBERS: u32 = 9u;

var<workgroup> d_colour: array<array<f32, 3>, TILE_PIXELS>;
var<workgroup> d_power: array<f32, AT_ONCE * TILE_PIXELS>;
var<workgroup> weights: array<f32, AT_ONCE * TILE_PIXELS>;
var<workgroup> n_live: atomic<u32>;
var<workgroup> n_live_read: u32;
// [AT_ONCE, N_NUMBERS, TILE_PX]: dp, dp·dx, dp·dy, dp·dx·dy, dp·dx², dp·dy² and weight·g of a column.
var<workgroup> column_sums: array<f32, AT_ONCE * N_NUMBERS * TILE_PX>;

@compute @workgroup_size(256)
fn backward(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let tile = group_of(group);
    if tile >= parameters.n_tiles {
        return;
    }
    let width = parameters.size_px[0];
    let height = parameters.size_px[1];
    let across = (width + TILE_PX - 1u) / TILE_PX;
    let x0 = tile % across * TILE_PX;
    let y0 = tile / across * TILE_PX;
    let x = x0 + thread % TILE_PX;
    let y = y0 + thread / TILE_PX;
    let centre = vec2(f32(x) + 0.5, f32(y) + 0.5);
    var live = x < width && y < height;
    var t = 1.0;
    var g = vec3(0.0);
    var rest = 0.0;
    if live {
        let at = y * width + x;
        let n_pixels = width * height;
        for (var channel = 0u; channel < 3u; channel++) {
            g[channel] = d_image[channel * n_pixels + at];
            rest += image[channel * n_pixels + at] * g[channel];
        }
    }
    d_colour[thread] = array(g.x, g.y, g.z);
    let end = starts[tile + 1u];
    for (var first = starts[tile]; first < end; first += BATCH) {
        let n = min(BATCH, end - first);
        if thread == 0u {
            atomicStore(&n_live, 0u);
        }
        workgroupBarrier();
        if live {
            atomicAdd(&n_live, 1u);
        }
        if thread < n {
            batch[thread] = splats[slot_of_pair[entries[first + thread]]];
        }
        workgroupBarrier();
        if thread == 0u {
            n_live_read = atomicLoad(&n_live);
        }
        if workgroupUniformLoad(&n_live_read) == 0u {
            // Every pixel has stopped: what is behind has no gradient.
            for (var i = thread; i < (end - first) * N_NUMBERS; i += TILE_PIXELS) {
                d_pairs[entries[first + i / N_NUMBERS] * N_NUMBERS + i % N_NUMBERS] = 0.0;
            }
            break;
        }
        for (var start = 0u; start < n; start += AT_ONCE) {
            for (var i = 0u; i < AT_ONCE; i++) {
                var dp = 0.0;
                var weight = 0.0;
                if live && start + i < n {
                    let splat = batch[start + i];
                    let alpha = blend(splat, centre).alpha;
                    let after = t * (1.0 - alpha);
                    if after < TRANSMITTANCE_MIN {
                        live = false;
                    } else if alpha > 0.0 {
                        weight = alpha * t;
                        let shade = dot(vec3(splat.colour[0], splat.colour[1], splat.colour[2]), g);
                        rest -= weight * shade;
                        // A saturated alpha does not follow its splat.
                        if alpha < ALPHA_MAX {
                            dp = (t * shade - rest / (1.0 - alpha)) * alpha;
                        }
                        t = after;
                    }
                }
                d_power[i * TILE_PIXELS + thread] = dp;
                weights[i * TILE_PIXELS + thread] = weight;
            }
            workgroupBarrier();
            add_columns(thread, start, x0, y0);
            workgroupBarrier();
            if thread < AT_ONCE * N_NUMBERS && start + thread / N_NUMBERS < n {
                let i = thread / N_NUMBERS;
                let number = thread % N_NUMBERS;
                d_pairs[entries[first + start + i] * N_NUMBERS + number] = add_up(i, number, batch[start + i]);
            }
        }
    }
}

fn add_columns(thread: u32, start: u32, x0: u32, y0: u32) {
    if thread >= AT_ONCE * TILE_PX {
        return;
    }
    let i = thread / TILE_PX;
    let column = thread % TILE_PX;
    let splat = batch[start + i];
    let right = f32(x0 + column) + 0.5 - splat.mean_px[0];
    let top = f32(y0) + 0.5 - splat.mean_px[1];
    var first = vec3(0.0);
    var second = vec3(0.0);
    var colour = vec3(0.0);
    for (var k = 0u; k < TILE_PX; k++) {
        let row = (k + i) % TILE_PX;
        let pixel = row * TILE_PX + column;
        let dp = d_power[i * TILE_PIXELS + pixel];
        let dy = top + f32(row);
        let dx = right - splat.shear * dy;
        first += dp * vec3(1.0, dx, dy);
        second += dp * vec3(dx * dy, dx * dx, dy * dy);
        let g = d_colour[pixel];
        colour += weights[i * TILE_PIXELS + pixel] * vec3(g[0], g[1], g[2]);
    }
    for (var k = 0u; k < 3u; k++) {
        column_sums[(i * N_NUMBERS + k) * TILE_PX + column] = first[k];
        column_sums[(i * N_NUMBERS + 3u + k) * TILE_PX + column] = second[k];
        column_sums[(i * N_NUMBERS + 6u + k) * TILE_PX + column] = colour[k];
    }
}

fn sum_of(i: u32, number: u32) -> f32 {
    let at = i * N_NUMBERS + number;
    var sum = 0.0;
    for (var k = 0u; k < TILE_PX; k++) {
        sum += column_sums[at * TILE_PX + (k + at) % TILE_PX];
    }
    return sum;
}

// One number of the gradient of splat i of the four, in the order of Splat's fields.
fn add_up(i: u32, number: u32, splat: Splat) -> f32 {
    let sum = sum_of(i, select(number, (number + 1u) % 6u, number < 6u));
    switch number {
        case 0u, 2u: { return splat.row_precision * sum; }
        case 1u: { return splat.column_precision * sum - splat.shear * (splat.row_precision * sum_of(i, 1u)); }
        case 3u, 4u: { return -0.5 * sum; }
        // dp is alpha·dL/d(alpha).
        case 5u: { return sum / splat.opacity; }
        default: { return sum; }
    }
}
