// A draft's surfaces: one sample for some pixels each way, where maps have one too.
// Goes behind search.glsl; lengths are in these samples.

uniform sampler2DArray uMaps;    // code values
uniform sampler2DArray uChroma;  // Cb, Cr
uniform int uMapStep;            // samples of a map across one of these
uniform float uChromaStep;       // and of the chroma planes
uniform ivec2 uChromaSize;

out vec4 oSurface; // code value, Cb, Cr, and which two cameras show it: i + 4 j, by their order

float codeAt(int camera, ivec2 pixel) {
    return texelFetch(uMaps, ivec3(pixel * uMapStep, uLayer[camera]), 0).r;
}

// 1 for the camera that weighs most; the first one of equals.
vec4 heaviest(vec4 weights) {
    float most = max(max(weights.x, weights.y), max(weights.z, weights.w));
    vec4 is = vec4(equal(weights, vec4(most)));
    return is * vec4(1.0, 1.0 - is.x, (1.0 - is.x) * (1.0 - is.y), (1.0 - is.x) * (1.0 - is.y) * (1.0 - is.z));
}

// Cb and Cr of the camera that a vector has its 1 for. Uniforms are not indexed: GPUs in software take long for that.
vec2 chromaOf(vec4 camera, vec2 at, float d) {
    vec2 shift = vec2(dot(camera, vec4(uShift[0].x, uShift[1].x, uShift[2].x, uShift[3].x)), dot(camera, vec4(uShift[0].y, uShift[1].y, uShift[2].y, uShift[3].y)));
    vec2 place = at + shift * d - uDolly.x * (d - uInfinity) * (at - uDolly.yz);
    ivec2 pixel = clamp(ivec2(floor(place * uChromaStep + 0.5)), ivec2(0), uChromaSize - 1);
    return texelFetch(uChroma, ivec3(pixel, int(dot(camera, vec4(uLayer)) + 0.5)), 0).rg;
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
    vec4 first = heaviest(weights);
    float most = dot(first, weights);
    weights -= first * weights;
    vec4 second = heaviest(weights);
    float more = dot(second, weights);
    second = more > 0.0 ? second : first;
    vec2 chroma = (most * chromaOf(first, at, d) + more * chromaOf(second, at, d)) / (most + more);
    oSurface = vec4((d - uRange.x) / (uRange.y - uRange.x), chroma, dot(first + 4.0 * second, vec4(0.0, 1.0, 2.0, 3.0)) / 255.0);
}
