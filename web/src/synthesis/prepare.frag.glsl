#version 300 es
// A real camera's decoded planes -> one texel a pixel: Y, Cb, Cr and the map's code value.
precision highp float;
precision highp int;
precision highp sampler2DArray;

uniform sampler2DArray uLuma;
uniform sampler2DArray uChroma; // Cb, Cr; filtered linearly
uniform sampler2DArray uMaps;   // code values, of the picture's size or half of it
uniform int uCamera;
uniform ivec2 uSize;         // of the picture, px
uniform vec2 uChromaTexel;   // 1 / size of the chroma plane
uniform bool uHalfMap;
uniform float uAgreement;    // code values within which half-size samples are one surface, 0..1

out vec4 oPixel;

const float COLOUR_STEP = 40.0 / 255.0; // counts as much as one sample of distance

// Chroma stands on the even columns, midway between rows 2j and 2j + 1.
vec2 chromaAt(vec2 pixel) {
    return texture(uChroma, vec3(vec2(pixel.x * 0.5 + 0.5, pixel.y * 0.5 + 0.25) * uChromaTexel, uCamera)).rg;
}

float lumaAt(ivec2 pixel) {
    return texelFetch(uLuma, ivec3(clamp(pixel, ivec2(0), uSize - 1), uCamera), 0).r;
}

vec3 rgb(vec3 yuv) {
    vec2 c = yuv.yz - 128.0 / 255.0;
    return vec3(yuv.x + 1.5748 * c.y, yuv.x - 0.1873 * c.x - 0.4681 * c.y, yuv.x + 1.8556 * c.x);
}

// Mean colour of the four pixels that a half-size sample stands for.
vec3 meanAt(ivec2 at) {
    ivec2 pixel = 2 * at;
    float luma = 0.25 * (lumaAt(pixel) + lumaAt(pixel + ivec2(1, 0)) + lumaAt(pixel + ivec2(0, 1)) + lumaAt(pixel + 1));
    return rgb(vec3(luma, chromaAt(vec2(pixel) + 0.5)));
}

float mapAt(ivec2 at, ivec2 size) {
    return texelFetch(uMaps, ivec3(clamp(at, ivec2(0), size - 1), uCamera), 0).r;
}

// Of the nearest 3 x 3 samples the surface of the one whose colour and place are most like the pixel's own.
float alongEdge(ivec2 pixel, ivec2 size, vec3 colour) {
    float costs[9];
    float values[9];
    float best = 1e9;
    float chosen = 0.0;
    for (int k = 0; k < 9; k++) {
        ivec2 at = pixel / 2 + ivec2(k % 3, k / 3) - 1;
        bool inside = all(greaterThanEqual(at, ivec2(0))) && all(lessThan(at, size));
        vec2 away = vec2(at) - (vec2(pixel) - 0.5) * 0.5;
        vec3 difference = abs(meanAt(at) - colour);
        costs[k] = inside ? (difference.r + difference.g + difference.b) / COLOUR_STEP + dot(away, away) : 1e9;
        values[k] = mapAt(at, size);
        if (costs[k] < best) {
            best = costs[k];
            chosen = values[k];
        }
    }
    float sum = 0.0;
    float total = 0.0;
    for (int k = 0; k < 9; k++) {
        if (costs[k] < 1e8 && abs(values[k] - chosen) <= uAgreement) {
            float weight = 1.0 / ((1.0 + costs[k]) * (1.0 + costs[k]));
            sum += weight * values[k];
            total += weight;
        }
    }
    return sum / total;
}

float enlarged(ivec2 pixel, vec3 yuv) {
    ivec2 size = (uSize + 1) / 2;
    vec2 place = (vec2(pixel) - 0.5) * 0.5;
    ivec2 at = ivec2(floor(place));
    vec2 part = place - vec2(at);
    float a = mapAt(at, size);
    float b = mapAt(at + ivec2(1, 0), size);
    float c = mapAt(at + ivec2(0, 1), size);
    float d = mapAt(at + 1, size);
    if (max(max(a, b), max(c, d)) - min(min(a, b), min(c, d)) <= uAgreement) {
        return mix(mix(a, b, part.x), mix(c, d, part.x), part.y);
    }
    float found = 0.0;
    // A loop of one turn: GPUs in software jump over those alone.
    for (int once = 0; once < 1; once++) found = alongEdge(pixel, size, rgb(yuv));
    return found;
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec3 yuv = vec3(lumaAt(pixel), chromaAt(vec2(pixel)));
    float code = uHalfMap ? enlarged(pixel, yuv) : texelFetch(uMaps, ivec3(pixel, uCamera), 0).r;
    oPixel = vec4(yuv, code);
}
