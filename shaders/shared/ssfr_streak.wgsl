// Streaks: what a sample splats of a drop that moves while the shutter is open, as seen by the
// camera, which may move too. The importing shader must bind `camera` and, with SHUTTER, `moments`.
#import "shared/shutter.wgsl"

#ifdef SHUTTER
// Largest number of splats along a streak.
const MOST_BEADS: f32 = 24.0;

// A moment of each of as many parts of the sample's light.
fn bead_moment(bead: u32, beads: u32) -> u32 {
    return u32((f32(bead) + 0.5) / f32(beads) * f32(MOMENTS));
}

// Displacement in eye space over the time of all moments, from the positions in the world at the
// first and at the last one.
fn streak_between(first: vec3f, last: vec3f) -> vec3f {
    let time = moments[MOMENTS - 1u].part - moments[0].part;
    let way = eye_from_world(camera_at(MOMENTS - 1u), last) - eye_from_world(camera_at(0u), first);
    return select(vec3f(0.0), way / time, time > 0.0);
}

// Displacement of a bead from the position at the sample's instant.
fn bead_off(streak: vec3f, bead: u32, beads: u32) -> vec3f {
    return select(
        streak * moments[bead_moment(bead, beads)].part, vec3f(0.0), beads == 1u);
}

// Number of splats, at most `step` pixels apart, along a streak about a position in eye space.
fn beads_along(streak: vec3f, c: vec3f, step: f32) -> u32 {
    let a = c - 0.5 * streak;
    let b = c + 0.5 * streak;
    if min(a.z, b.z) <= 0.0 {
        return 1u;
    }
    let pixels = length(project(camera, b) - project(camera, a));
    return u32(clamp(ceil(pixels / step), 1.0, MOST_BEADS));
}
#else

fn bead_off(streak: vec3f, bead: u32, beads: u32) -> vec3f {
    return vec3f(0.0);
}

fn beads_along(streak: vec3f, c: vec3f, step: f32) -> u32 {
    return 1u;
}
#endif
