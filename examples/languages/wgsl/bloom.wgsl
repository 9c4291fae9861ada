// 13 taps down, a tent of 3 x 3 taps up.
struct Levels {
    texel: vec2f,
    radius: f32,
    gain: f32,
    share: f32,
}

@group(0) @binding(0) var source: texture_2d<f32>;
@group(0) @binding(1) var here: texture_2d<f32>;
@group(0) @binding(2) var linear: sampler;
@group(0) @binding(3) var<uniform> levels: Levels;

fn tap(uv: vec2f, x: f32, y: f32) -> vec4f {
    return textureSample(source, linear, uv + vec2f(x, y) * levels.texel);
}

@fragment
fn down(@location(0) uv: vec2f) -> @location(0) vec4f {
    let inner = tap(uv, -1, -1) + tap(uv, 1, -1) + tap(uv, -1, 1) + tap(uv, 1, 1);
    let sides = tap(uv, 0, -2) + tap(uv, -2, 0) + tap(uv, 2, 0) + tap(uv, 0, 2);
    let corners = tap(uv, -2, -2) + tap(uv, 2, -2) + tap(uv, -2, 2) + tap(uv, 2, 2);
    return tap(uv, 0, 0) * 0.125 + inner * 0.125 + sides * 0.0625 + corners * 0.03125;
}

@fragment
fn up(@location(0) uv: vec2f) -> @location(0) vec4f {
    var sum = vec4f();
    for (var y = -1; y <= 1; y++) {
        for (var x = -1; x <= 1; x++) {
            let weight = f32((2 - abs(x)) * (2 - abs(y)));
            sum += weight * tap(uv, f32(x) * levels.radius, f32(y) * levels.radius);
        }
    }
    return levels.gain * sum / 16.0 + levels.share * textureSample(here, linear, uv);
}
