// A view: where its surfaces are, by the vote of the cell's cameras, and what the cameras that see them show there.
// Goes behind search.glsl. What few pixels need stands in loops of one turn: GPUs in software jump over those alone.

uniform sampler2DArray uCameras; // Y, Cb, Cr, code value
uniform sampler2D uOriginal;     // what a camera really saw from there
uniform vec4 uArea;              // x, y, width, height of what is drawn
uniform bool uFromTop;           // the first row drawn is the picture's first
uniform vec2 uOffset;            // px that the picture is moved by
uniform int uLook;
uniform float uWipe;             // share of the width, from the left, that shows the picture whatever the look
uniform bool uFine;              // cubic fetch and soft contours
uniform bool uSoftens;           // more than one camera: a real camera's own contours are soft already

out vec4 oColour;

const float SHARPNESS = -0.7;    // Keys' parameter of the cubic fetch
const float NEIGHBOUR = 0.8;     // how much a neighbour's surface counts at a contour
const float STRAY = 0.1;         // how much a pixel counts that none of its neighbours is like
const int FILL_REACH = 24;       // px that a gap is looked over for its ends
const int PAINT_REACH = 32;      // px that holes are painted from

const float DIFFERENCE_GAIN = 4.0;

const int DISPARITY = 1;
const int LAYERS = 2;
const int PROVENANCE = 3;
const int DISAGREEMENT = 4;
const int DIFFERENCE = 5;
const int RAW = 6;              // disparity in 16 bits, for programs

float codeAt(int layer, ivec2 pixel) {
    return texelFetch(uCameras, ivec3(pixel, layer), 0).a;
}

float surfaceAt(vec2 at) {
    vec4 found;
    float background;
    bool isEdge;
    return surfaceAt(at, found, background, isEdge);
}

vec4 cubicWeights(float t) {
    float s = 1.0 - t;
    float a = SHARPNESS;
    float inner = ((a + 2.0) * t - (a + 3.0)) * t * t + 1.0;
    float after = ((a + 2.0) * s - (a + 3.0)) * s * s + 1.0;
    return vec4(a * t * s * s, inner, after, a * s * t * t);
}

vec4 linear(vec2 at, int layer) {
    return texture(uCameras, vec3((at + 0.5) / vec2(uSize), layer));
}

// Cubic convolution in nine linear fetches: the two inner weights have one sign.
vec4 cubic(vec2 at, int layer) {
    vec2 base = floor(at);
    vec4 x = cubicWeights(at.x - base.x);
    vec4 y = cubicWeights(at.y - base.y);
    vec3 places = vec3(-1.0, 0.0, 2.0);
    vec3 weightX = vec3(x.x, x.y + x.z, x.w);
    vec3 weightY = vec3(y.x, y.y + y.z, y.w);
    vec3 atX = base.x + vec3(places.x, x.z / weightX.y, places.z);
    vec3 atY = base.y + vec3(places.x, y.z / weightY.y, places.z);
    vec4 sum = vec4(0.0);
    for (int j = 0; j < 3; j++) {
        for (int i = 0; i < 3; i++) sum += weightX[i] * weightY[j] * linear(vec2(atX[i], atY[j]), layer);
    }
    return sum;
}

// Of the four pixels around a place those on a surface; w: their share.
vec4 beside(vec2 at, int layer, float d) {
    ivec2 base = ivec2(floor(at));
    vec2 part = at - vec2(base);
    vec4 sum = vec4(0.0);
    for (int k = 0; k < 4; k++) {
        ivec2 offset = ivec2(k & 1, k >> 1);
        vec4 pixel = texelFetch(uCameras, ivec3(min(base + offset, uSize - 1), layer), 0);
        vec2 share = mix(1.0 - part, part, vec2(offset));
        float weight = abs(px(pixel.a) - d) <= TOLERANCE ? share.x * share.y : 0.0;
        sum += weight * vec4(pixel.rgb, 1.0);
    }
    return sum.w > 1e-3 ? vec4(sum.rgb / sum.w, sum.w) : vec4(0.0);
}

// What a camera shows at a place that is the view's at disparity d, and how much that counts; w = 0: it does not see it.
vec4 fetch(int layer, vec2 place, float d) {
    if (any(lessThanEqual(place, vec2(-0.5))) || any(greaterThanEqual(place, vec2(uSize) - 0.5))) return vec4(0.0);
    place = clamp(place, vec2(0.0), vec2(uSize - 1));
    vec4 pixel = linear(place, layer);
    if (abs(px(pixel.a) - d) <= TOLERANCE) {
        if (uFine) {
            vec4 sharp = cubic(place, layer);
            // The cubic mean of the map differs where its footprint holds another surface.
            if (abs(px(sharp.a) - d) <= TOLERANCE) pixel = sharp;
        }
        return vec4(pixel.rgb, 1.0);
    }
    vec4 edge = beside(place, layer, d);
    return vec4(edge.rgb, 0.5 * edge.w);
}

// Far is blue, near is yellow.
vec3 ramp(float t) {
    return mix(mix(vec3(0.05, 0.07, 0.35), vec3(0.75, 0.2, 0.45), min(2.0 * t, 1.0)), vec3(1.0, 0.95, 0.4), max(2.0 * t - 1.0, 0.0));
}

// What no camera knows lies behind what is beside it: the farther one of both ends of the gap on the row.
float fill(vec2 at, float background) {
    float farther = uRange.y + 1.0;
    for (int side = -1; side <= 1; side += 2) {
        for (int k = 1; k <= FILL_REACH; k++) {
            vec2 there = at + vec2(side * k, 0);
            if (there.x < -0.5 || there.x > float(uSize.x) - 0.5) break;
            float d = surfaceAt(there);
            if (d == UNKNOWN) continue;
            farther = min(farther, d);
            break;
        }
    }
    return farther > uRange.y ? background : farther;
}

// Y, Cb, Cr of a place at disparity d, and the cameras' weight; how many see it, and the weighted squares of Y.
vec4 blend(vec2 at, float d, out int seen, out float squares) {
    vec4 sum = vec4(0.0);
    squares = 0.0;
    seen = 0;
    for (int i = 0; i < 4; i++) {
        vec4 camera = cameraOf(vec4(equal(ivec4(i), ivec4(0, 1, 2, 3))));
        if (camera.w == 0.0) continue;
        vec4 pixel = fetch(int(camera.z + 0.5), baseOf(at) + slopeOf(camera.xy, at) * d, d);
        if (pixel.w == 0.0) continue;
        float weight = pixel.w * camera.w;
        sum += weight * vec4(pixel.rgb, 1.0);
        squares += weight * pixel.r * pixel.r;
        seen++;
    }
    if (seen > 0) {
        sum.rgb /= sum.w;
        squares /= sum.w;
    }
    return sum;
}

// What no camera sees: the first pixels on the row that some do, of the farther surface.
vec3 paint(vec2 at) {
    vec4 sum = vec4(0.0);
    float farthest = uRange.y + 1.0;
    for (int side = -1; side <= 1; side += 2) {
        for (int k = 1; k <= PAINT_REACH; k++) {
            vec2 there = at + vec2(side * k, 0);
            if (there.x < -0.5 || there.x > float(uSize.x) - 0.5) break;
            float d = surfaceAt(there);
            if (d == UNKNOWN) continue;
            int seen;
            float squares;
            vec4 colour = blend(there, d, seen, squares);
            if (seen == 0) continue;
            if (d < farthest - TOLERANCE) sum = vec4(0.0);
            if (d <= farthest + TOLERANCE) {
                sum += vec4(colour.rgb, 1.0) / float(k * k);
                farthest = d;
            }
            break;
        }
    }
    return sum.w > 0.0 ? sum.rgb / sum.w : vec3(16.0, 128.0, 128.0) / 255.0;
}

// A contour as soft as a lens makes it: what the neighbours' surfaces have here counts too, and a stray pixel little.
vec3 soften(vec2 at, float d, vec3 own) {
    vec4 sum = vec4(0.0);
    int alike = 0;
    for (int k = 0; k < 4; k++) {
        vec2 there = at + vec2(k == 0 ? 1 : k == 1 ? -1 : 0, k == 2 ? 1 : k == 3 ? -1 : 0);
        float other = surfaceAt(there);
        if (other == UNKNOWN) continue;
        if (abs(other - d) <= TOLERANCE) {
            alike++;
            continue;
        }
        int seen;
        float squares;
        vec4 colour = blend(at, other, seen, squares);
        if (seen > 0) sum += NEIGHBOUR * vec4(colour.rgb, 1.0);
    }
    sum += (alike == 0 ? STRAY : 1.0 + NEIGHBOUR * float(alike)) * vec4(own, 1.0);
    return sum.rgb / sum.w;
}

void main() {
    vec2 drawn = (gl_FragCoord.xy - uArea.xy) / uArea.zw;
    vec2 at = vec2(drawn.x, uFromTop ? drawn.y : 1.0 - drawn.y) * vec2(uSize) - 0.5 + uOffset;
    vec4 found;
    float background;
    bool isEdge;
    float d = surfaceAt(at, found, background, isEdge);
    if (d == UNKNOWN) d = fill(at, background);
    int seen;
    float squares;
    vec4 sum = blend(at, d, seen, squares);
    vec3 yuv = seen > 0 ? sum.rgb : paint(at);
    bool softens = uFine && isEdge && uSoftens;
    for (int once = 0; once < int(softens); once++) yuv = soften(at, d, yuv);
    float t = (d - uRange.x) / (uRange.y - uRange.x);
    vec3 colour = rgb(yuv);
    int look = drawn.x < uWipe ? 0 : uLook;
    if (look == DISPARITY) colour = ramp(t);
    if (look == LAYERS) colour = ramp((floor(t * 11.99) + 0.5) / 12.0) * (0.35 + 0.65 * colour.g);
    if (look == PROVENANCE) {
        vec3 by = seen == 0 ? vec3(0.9, 0.2, 0.2) : seen == 1 ? vec3(0.95, 0.7, 0.2) : vec3(0.1, 0.35 + 0.15 * float(seen), 0.4);
        colour = mix(vec3(colour.g), by, 0.7);
    }
    if (look == DISAGREEMENT) colour = ramp(min(sqrt(max(squares - sum.r * sum.r, 0.0)) * 12.0, 1.0));
    if (look == DIFFERENCE) {
        vec3 away = abs(colour - texelFetch(uOriginal, ivec2(clamp(at + 0.5, vec2(0.0), vec2(uSize) - 0.5)), 0).rgb);
        colour = ramp(min(max(max(away.r, away.g), away.b) * DIFFERENCE_GAIN, 1.0));
    }
    if (look == RAW) colour = vec3(floor(t * 255.0) / 255.0, fract(t * 255.0), seen == 0 ? 1.0 : 0.0);
    oColour = vec4(colour, 1.0);
}
