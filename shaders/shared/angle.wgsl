// Angle in −π..π of a number of turns, which device sines need: they err by 2⁻¹¹ there, and by
// anything beyond.
fn angle_of(turns: f32) -> f32 {
    return 6.2831853 * (turns - round(turns));
}
