// The same in all directions.
//#fill const CHALK_ALBEDO: f32 = {chalk_albedo};

fn blue_chalk(a: Angles, m: f32) -> f32 {
    return CHALK_ALBEDO / PI;
}
