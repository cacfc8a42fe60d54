// The normal distribution: how much of a Gaussian of deviation 1 lies beyond a line, and the line that cuts off a share.

// Share beyond a line at distance x >= 0; off by 1e-7 at most. Source: [AbramowitzStegun1964] 26.2.17.
fn beyond_line(x: f32) -> f32 {
    let t = 1.0 / (1.0 + 0.2316419 * x);
    let tail = t * (0.319381530 + t * (-0.356563782 + t * (1.781477937 + t * (-1.821255978 + t * 1.330274429))));
    return 0.3989422804 * exp(-0.5 * x * x) * tail;
}

// The line beyond which a share lies, 0 for a half and more; off by 5e-4 at most. Source: [AbramowitzStegun1964] 26.2.23.
fn distance_of(share: f32) -> f32 {
    let t = sqrt(-2.0 * log(clamp(share, 1e-12, 0.5)));
    let x = t - (2.515517 + t * (0.802853 + t * 0.010328)) / (1.0 + t * (1.432788 + t * (0.189269 + t * 0.001308)));
    return max(0.0, x);
}
