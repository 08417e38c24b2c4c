#version 300 es
// What the shaders of views share: where cameras see a point, and which surface a view has there. They define `codeAt`.
// No uniform is indexed by a variable, nor in a function by what is handed to it: GPUs in software take long for that.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;

uniform sampler2D uNear;         // per tile, in each camera's channel: the largest code value; 0: none
uniform sampler2D uFar;          // likewise 1 - the smallest
uniform float uTile;             // samples across a tile
uniform vec4 uShiftX;            // samples from the view to each camera for each px of disparity
uniform vec4 uShiftY;
uniform vec4 uWeight;            // of the cameras, falling; 0: this one does not count
uniform ivec4 uLayer;            // of each camera in the array textures
uniform vec2 uRange;             // px that the code values 0 and 1 mean
uniform vec3 uDolly;             // how far ahead of the cameras' plane the view stands, 1 / px; the place it moves to
uniform float uInfinity;         // disparity of infinitely distant points, px
uniform ivec2 uSize;             // of the picture, samples

const float UNKNOWN = -1e9;
const float REACH = 0.54;       // samples around its place that a moved one covers
const float TOLERANCE = 1.5;    // px within which disparities are one surface
const float RATIO = 1.3;        // by which farther cameras must outweigh nearer ones
const int MOST_STEPS = 256;

// Code value of a sample of a layer.
float codeAt(int layer, ivec2 pixel);

float px(float code) {
    return mix(uRange.x, uRange.y, code);
}

bool isInside(ivec2 pixel) {
    return all(greaterThanEqual(pixel, ivec2(0))) && all(lessThan(pixel, uSize));
}

// A camera sees the view's point `at` at disparity d where `base + slope * d` is.
vec2 baseOf(vec2 at) {
    return at + uDolly.x * uInfinity * (at - uDolly.yz);
}

vec2 slopeOf(vec2 shift, vec2 at) {
    return shift - uDolly.x * (at - uDolly.yz);
}

// Disparity of a camera's pixel where it is seen there in the view, else UNKNOWN; `surface`: what the pixel has.
float seenThere(int layer, vec2 base, vec2 slope, float d, out float surface) {
    ivec2 pixel = ivec2(floor(base + slope * d + 0.5));
    surface = d;
    if (!isInside(pixel)) return UNKNOWN;
    surface = px(codeAt(layer, pixel));
    vec2 miss = abs(base + slope * surface - vec2(pixel));
    return max(miss.x, miss.y) <= REACH ? surface : UNKNOWN;
}

// The nearest surface that a camera has at a place of the view, between two bounds, near to far.
float search(int layer, vec2 base, vec2 slope, float near, float far) {
    vec2 way = abs(slope * (near - far));
    float travel = max(way.x, way.y);
    bool isOne = travel <= 1.0;
    int steps = isOne ? 0 : min(int(ceil(travel)), MOST_STEPS);
    float stride = isOne ? 1e9 : (near - far) / float(steps);
    float d = isOne ? 0.5 * (near + far) : near;
    bool isOwn = false;
    for (int k = 0; k <= steps;) {
        float surface;
        float found = seenThere(layer, base, slope, d, surface);
        if (found > UNKNOWN) return found;
        // Between two steps both axes may round differently: the surface's own place decides.
        isOwn = !isOwn && abs(d - surface) < stride;
        k += isOwn ? 0 : 1;
        d = isOwn ? surface : near - float(k) * stride;
    }
    return UNKNOWN;
}

// Surfaces are tried near to far; a farther one wins where its cameras weigh RATIO times the winner so far.
float vote(vec4 found) {
    float best = UNKNOWN;
    float strength = 0.0;
    for (int group = 0; group < 4; group++) {
        float nearest = max(max(found.x, found.y), max(found.z, found.w));
        if (nearest == UNKNOWN) break;
        vec4 member = vec4(greaterThanEqual(found, vec4(nearest - TOLERANCE))) * uWeight;
        float total = dot(member, vec4(1.0));
        if (group == 0 || total > RATIO * strength) {
            best = dot(member, found) / total;
            strength = total;
        }
        found = mix(found, vec4(UNKNOWN), greaterThan(member, vec4(0.0)));
    }
    return best;
}

// Disparity of the view at a place, by all cameras, or UNKNOWN; `found`: by each; `background`: the farthest that may be there.
float surfaceAt(vec2 at, out vec4 found, out float background, out bool isEdge) {
    ivec2 tile = ivec2(clamp(at, vec2(0.0), vec2(uSize - 1)) / uTile);
    vec4 near = texelFetch(uNear, tile, 0);
    vec4 far = 1.0 - texelFetch(uFar, tile, 0);
    found = vec4(UNKNOWN);
    background = uRange.y;
    float foreground = uRange.x;
    vec4 nears = mix(uRange.xxxx, uRange.yyyy, near);
    vec4 fars = mix(uRange.xxxx, uRange.yyyy, far);
    vec4 isThere = vec4(greaterThan(near, vec4(0.0)));
    vec2 base = baseOf(at);
    if (near.x > 0.0) found.x = search(uLayer.x, base, slopeOf(vec2(uShiftX.x, uShiftY.x), at), nears.x, fars.x);
    if (near.y > 0.0) found.y = search(uLayer.y, base, slopeOf(vec2(uShiftX.y, uShiftY.y), at), nears.y, fars.y);
    if (near.z > 0.0) found.z = search(uLayer.z, base, slopeOf(vec2(uShiftX.z, uShiftY.z), at), nears.z, fars.z);
    if (near.w > 0.0) found.w = search(uLayer.w, base, slopeOf(vec2(uShiftX.w, uShiftY.w), at), nears.w, fars.w);
    vec4 far4 = mix(uRange.yyyy, fars, isThere);
    vec4 near4 = mix(uRange.xxxx, nears, isThere);
    background = min(min(far4.x, far4.y), min(far4.z, far4.w));
    foreground = max(max(near4.x, near4.y), max(near4.z, near4.w));
    background = min(background, foreground);
    isEdge = foreground - background > TOLERANCE;
    return vote(found);
}

// Shift (x, y), layer and weight of the camera that a vector has its 1 for.
vec4 cameraOf(vec4 is) {
    return vec4(dot(is, uShiftX), dot(is, uShiftY), dot(is, vec4(uLayer)), dot(is, uWeight));
}

vec3 rgb(vec3 yuv) {
    vec3 c = (yuv * 255.0 - vec3(16.0, 128.0, 128.0)) / vec3(219.0, 224.0, 224.0);
    return vec3(c.x + 1.5748 * c.z, c.x - 0.18732 * c.y - 0.46812 * c.z, c.x + 1.8556 * c.y);
}
