// A draft's surfaces, at half the picture's size: one sample for 2 x 2 pixels, around the middle of the four.
// Goes behind search.glsl; lengths are in these samples.

uniform sampler2DArray uMaps;    // code values
uniform sampler2DArray uChroma;  // Cb, Cr
uniform int uMapStep;            // samples of a map across one of these

out vec4 oSurface; // code value, Cb, Cr, and which cameras see it: one bit each

float codeAt(int camera, ivec2 pixel) {
    return texelFetch(uMaps, ivec3(pixel * uMapStep, camera), 0).r;
}

// Weighted Cb and Cr of a camera, and its weight.
vec3 chromaOf(int camera, vec2 at, float d, float seen) {
    float weight = seen * uWeight[camera];
    if (weight == 0.0) return vec3(0.0);
    ivec2 place = clamp(ivec2(floor(placeOf(camera, at, d) + 0.5)), ivec2(0), uSize - 1);
    return weight * vec3(texelFetch(uChroma, ivec3(place, camera), 0).rg, 1.0);
}

void main() {
    vec2 at = floor(gl_FragCoord.xy);
    vec4 found;
    float background;
    bool isEdge;
    float d = surfaceAt(at, found, background, isEdge);
    // What no camera knows is like the farthest thing around, as far as any camera looks there.
    vec4 seen = d == UNKNOWN ? vec4(1.0) : vec4(lessThanEqual(abs(found - d), vec4(TOLERANCE)));
    d = d == UNKNOWN ? background : d;
    // The two that count most are enough for a draft.
    vec4 weights = seen * uWeight;
    vec2 more = max(weights.xz, weights.yw);
    vec2 less = min(weights.xz, weights.yw);
    float second = max(min(more.x, more.y), max(less.x, less.y));
    seen *= vec4(greaterThanEqual(weights, vec4(second)));
    vec3 sum = chromaOf(0, at, d, seen.x) + chromaOf(1, at, d, seen.y) + chromaOf(2, at, d, seen.z) + chromaOf(3, at, d, seen.w);
    oSurface = vec4((d - uRange.x) / (uRange.y - uRange.x), sum.xy / sum.z, dot(seen, vec4(1.0, 2.0, 4.0, 8.0)) / 255.0);
}
