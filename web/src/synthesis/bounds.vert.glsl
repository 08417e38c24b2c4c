#version 300 es
// Moves each block of each camera to the view, as a point over all tiles that any of its pixels may fall into.
precision highp float;
precision highp int;
precision highp sampler2D;

uniform sampler2D uBlocks;
uniform float uBlock;     // px across a block, and across a tile
uniform ivec2 uGrid;      // blocks across and down a picture; tiles of the view likewise
uniform vec2 uShift[4];   // px from the view to the camera for each px of disparity
uniform ivec4 uLayer;     // of the blocks
uniform vec2 uRange;      // px that the code values 0 and 1 mean
uniform vec3 uDolly;      // see view.frag.glsl
uniform float uInfinity;

flat out vec4 vNear;
flat out vec4 vFar;

const float REACH = 1.0;  // px around a moved pixel that it may cover, and for rounding

// Where the view sees a camera's point of disparity d.
vec2 seenAt(vec2 point, vec2 shift, float d) {
    return uDolly.yz + (point - shift * d - uDolly.yz) / (1.0 - uDolly.x * (d - uInfinity));
}

void main() {
    int perCamera = uGrid.x * uGrid.y;
    int camera = gl_VertexID / perCamera;
    int block = gl_VertexID % perCamera;
    ivec2 at = ivec2(block % uGrid.x, block / uGrid.x);
    vec2 codes = texelFetch(uBlocks, ivec2(at.x, at.y + uLayer[camera] * uGrid.y), 0).rg;
    vec2 bounds = mix(uRange.xx, uRange.yy, codes);
    vec2 shift = uShift[camera];
    vec2 first = vec2(at) * uBlock;
    vec2 last = first + uBlock - 1.0;
    vec2 low = min(seenAt(first, shift, bounds.x), seenAt(first, shift, bounds.y)) - REACH;
    vec2 high = max(seenAt(last, shift, bounds.x), seenAt(last, shift, bounds.y)) + REACH;
    low = max(floor(low / uBlock), vec2(0.0));
    high = min(floor(high / uBlock), vec2(uGrid - 1));
    vec4 channel = vec4(camera == 0, camera == 1, camera == 2, camera == 3);
    vNear = channel * max(codes.r, 1.0 / 255.0); // 0 stands for nothing
    vFar = channel * (1.0 - codes.g);
    vec2 span = high - low + 1.0;
    bool isInside = all(greaterThan(span, vec2(0.0)));
    gl_Position = isInside ? vec4((low + high + 1.0) / vec2(uGrid) - 1.0, 0.0, 1.0) : vec4(2.0, 2.0, 2.0, 1.0);
    gl_PointSize = max(span.x, span.y);
}
