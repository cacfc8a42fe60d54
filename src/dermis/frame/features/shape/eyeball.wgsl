// Shape of an eyeball [mm], in the size of an average eye, around the centre of the ball.

//#fill const SCLERA_MM: f32 = {sclera_mm}; // radius of the ball
//#fill const CORNEA_MM: f32 = {cornea_mm}; // radius of the cornea's front
//#fill const CORNEA_AT: f32 = {cornea_at}; // its centre on the axis
//#fill const LIMBUS_MM: f32 = {limbus_mm}; // radius of the circle where they meet
//#fill const APEX_AT: f32 = {apex_at}; // the cornea's apex on the axis

// Distance from the centre to the surface, by the cosine of the angle to the axis.
fn eyeball_radius(cosine: f32) -> f32 {
    let beside = CORNEA_AT * CORNEA_AT * (1.0 - cosine * cosine);
    let cornea = CORNEA_AT * cosine + sqrt(max(CORNEA_MM * CORNEA_MM - beside, 0.0));
    let edge = sqrt(1.0 - LIMBUS_MM * LIMBUS_MM / (SCLERA_MM * SCLERA_MM));
    return select(SCLERA_MM, cornea, cosine > edge);
}
