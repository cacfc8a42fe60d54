// Fresnel reflectance: Schlick's approximation or exact.

override EXACT_FRESNEL: bool = false;
override METALS: bool = false; // whether there are surfaces that are not skin and may be metal

//#if METALS
var<private> metalness: f32; // of the surface, whose reflectance is that of metal where it is 1
//#end

fn schlick(cos_theta: f32, f0: f32) -> f32 {
    let c = clamp(1.0 - cos_theta, 0.0, 1.0);
    let c2 = c * c;
    return f0 + (1.0 - f0) * c2 * c2 * c;
}

// Exact reflectance for unpolarised light from air onto a dielectric. Source: [CookTorrance1982].
fn dielectric(cos_theta: f32, eta: f32) -> f32 {
    let c = clamp(cos_theta, 0.0, 1.0);
    let g = sqrt(eta * eta - 1.0 + c * c);
    let across = (g - c) / (g + c);
    let along = (c * (g + c) - 1.0) / (c * (g - c) + 1.0);
    return 0.5 * across * across * (1.0 + along * along);
}

fn fresnel(cos_theta: f32) -> f32 {
    var reflectance = schlick(cos_theta, skin.f0);
    if (EXACT_FRESNEL) {
        reflectance = dielectric(cos_theta, skin.eta);
    }
    //#if METALS
    reflectance = mix(reflectance, 1.0, metalness);
    //#end
    return reflectance;
}
