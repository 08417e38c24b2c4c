#version 300 es
// A draft of a view: its surfaces are known, at fewer places; what is left is each pixel's brightness.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;

uniform sampler2D uSurface;      // see geometry.frag.glsl
uniform vec4 uWeight;            // see search.glsl
uniform ivec4 uLayer;
uniform sampler2DArray uLuma;
uniform vec2 uShift[4];          // px from the view to the camera for each px of disparity
uniform vec2 uRange;             // px that the code values 0 and 1 mean
uniform vec3 uDolly;             // see search.glsl
uniform float uInfinity;
uniform ivec2 uSize;             // of the picture, px
uniform float uStep;             // px across a sample of the surfaces
uniform float uFirst;            // px at which the first one lies
uniform ivec2 uSurfaceSize;
uniform vec2 uLumaTexel;         // 1 / size of the luma planes
uniform vec4 uArea;              // as in view.frag.glsl
uniform bool uFromTop;
uniform vec2 uOffset;

out vec4 oColour;

// Y of the camera that a vector has its 1 for. Uniforms are not indexed: GPUs in software take long for that.
float lumaOf(vec4 camera, vec2 at, float d) {
    vec2 shift = vec2(dot(camera, vec4(uShift[0].x, uShift[1].x, uShift[2].x, uShift[3].x)), dot(camera, vec4(uShift[0].y, uShift[1].y, uShift[2].y, uShift[3].y)));
    return textureLod(uLuma, vec3((at + shift * d) * uLumaTexel, dot(camera, vec4(uLayer))), 0.0).r;
}

void main() {
    vec2 drawn = (gl_FragCoord.xy - uArea.xy) / uArea.zw;
    vec2 at = vec2(drawn.x, uFromTop ? drawn.y : 1.0 - drawn.y) * vec2(uSize) - 0.5 + uOffset;
    ivec2 sampled = clamp(ivec2(floor((at - uFirst) / uStep + 0.5)), ivec2(0), uSurfaceSize - 1);
    vec4 surface = texelFetch(uSurface, sampled, 0);
    int seen = int(surface.a * 255.0 + 0.5);
    vec4 first = vec4(equal(ivec4(seen & 3), ivec4(0, 1, 2, 3)));
    vec4 second = vec4(equal(ivec4(seen >> 2), ivec4(0, 1, 2, 3)));
    float d = mix(uRange.x, uRange.y, surface.r);
    vec2 ahead = at - uDolly.x * (d - uInfinity) * (at - uDolly.yz) + 0.5;
    vec2 weight = vec2(dot(first, uWeight), dot(second, uWeight));
    float luma = dot(weight, vec2(lumaOf(first, ahead, d), lumaOf(second, ahead, d))) / (weight.x + weight.y);
    vec3 c = (vec3(luma, surface.gb) * 255.0 - vec3(16.0, 128.0, 128.0)) / vec3(219.0, 224.0, 224.0);
    oColour = vec4(c.x + 1.5748 * c.z, c.x - 0.18732 * c.y - 0.46812 * c.z, c.x + 1.8556 * c.y, 1.0);
}
