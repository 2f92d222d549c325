// Summation of wide counters, which are words.

/// Four bits that say which of four directions have layers.
fn occluded_of_four(layers: vec4<u32>) -> u32 {
    let bits = select(vec4(0u), vec4(1u, 2u, 4u, 8u), layers != vec4(0u));
    return bits.x | bits.y | bits.z | bits.w;
}

@compute @workgroup_size(WORKGROUP)
fn wide_summation(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let row = counter_row(group, local);
    let rows = frame.cells.y * frame.cells.z;
    let plane = plane();
    // Separate variables: a dynamically indexed array would live in memory.
    var above_0 = vec4(0u);
    var above_1 = vec4(0u);
    var above_2 = vec4(0u);
    var above_3 = vec4(0u);
    var below_0 = vec4(0u);
    var below_1 = vec4(0u);
    var below_2 = vec4(0u);
    var below_3 = vec4(0u);
    for (var column = row.first; column < row.end; column++) {
        let counter = row.counter + column * frame.cells.y;
        above_0 += take_deltas(counter, plane);
        above_1 += take_deltas(counter + 4u * plane, plane);
        above_2 += take_deltas(counter + 8u * plane, plane);
        above_3 += take_deltas(counter + 12u * plane, plane);
        below_0 += take_deltas(counter + 16u * plane, plane);
        below_1 += take_deltas(counter + 20u * plane, plane);
        below_2 += take_deltas(counter + 24u * plane, plane);
        below_3 += take_deltas(counter + 28u * plane, plane);
        masks[row.mask + column * rows] = occluded_of_four(above_0)
            | (occluded_of_four(above_1) << 4u)
            | (occluded_of_four(above_2) << 8u)
            | (occluded_of_four(above_3) << 12u)
            | (occluded_of_four(below_0) << 16u)
            | (occluded_of_four(below_1) << 20u)
            | (occluded_of_four(below_2) << 24u)
            | (occluded_of_four(below_3) << 28u);
    }
}
