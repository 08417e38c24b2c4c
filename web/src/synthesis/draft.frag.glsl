#version 300 es
// A draft of a view: its surfaces are known at half size; what is left is each pixel's brightness.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;

uniform sampler2D uSurface;      // see geometry.frag.glsl
uniform vec4 uWeight;
uniform sampler2DArray uLuma;
uniform vec2 uShift[4];          // px from the view to the camera for each px of disparity
uniform vec2 uRange;             // px that the code values 0 and 1 mean
uniform vec3 uDolly;             // see search.glsl
uniform float uInfinity;
uniform ivec2 uSize;             // of the picture, px
uniform ivec2 uHalfSize;
uniform vec2 uLumaTexel;         // 1 / size of the luma planes
uniform vec4 uArea;              // as in view.frag.glsl
uniform bool uFromTop;
uniform vec2 uOffset;

out vec4 oColour;

// Weighted Y of a camera, and its weight.
vec2 lumaOf(int camera, vec2 at, float d, int seen) {
    if (seen == 0 || uWeight[camera] == 0.0) return vec2(0.0);
    return uWeight[camera] * vec2(textureLod(uLuma, vec3((at + uShift[camera] * d) * uLumaTexel, camera), 0.0).r, 1.0);
}

void main() {
    vec2 drawn = (gl_FragCoord.xy - uArea.xy) / uArea.zw;
    vec2 at = vec2(drawn.x, uFromTop ? drawn.y : 1.0 - drawn.y) * vec2(uSize) - 0.5 + uOffset;
    ivec2 sampled = clamp(ivec2(floor(0.5 * at + 0.25)), ivec2(0), uHalfSize - 1);
    vec4 surface = texelFetch(uSurface, sampled, 0);
    int seen = int(surface.a * 255.0 + 0.5);
    float d = mix(uRange.x, uRange.y, surface.r);
    vec2 ahead = at - uDolly.x * (d - uInfinity) * (at - uDolly.yz) + 0.5;
    vec2 sum = vec2(0.0);
    sum += lumaOf(0, ahead, d, seen & 1) + lumaOf(1, ahead, d, seen & 2) + lumaOf(2, ahead, d, seen & 4) + lumaOf(3, ahead, d, seen & 8);
    vec3 c = (vec3(sum.x / sum.y, surface.gb) * 255.0 - vec3(16.0, 128.0, 128.0)) / vec3(219.0, 224.0, 224.0);
    oColour = vec4(c.x + 1.5748 * c.z, c.x - 0.18732 * c.y - 0.46812 * c.z, c.x + 1.8556 * c.y, 1.0);
}
