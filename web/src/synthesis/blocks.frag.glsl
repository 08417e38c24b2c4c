#version 300 es
// The nearest and the farthest code value of each block of each camera, cameras below one another.
precision highp float;
precision highp int;
precision highp sampler2DArray;

uniform sampler2DArray uMaps;
uniform ivec2 uMapSize;   // samples
uniform int uSamples;     // of a map across a block
uniform int uMargin;      // samples around a block that its pixels may take their disparity from
uniform int uRows;        // of blocks in a picture

out vec2 oBounds;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    int camera = at.y / uRows;
    ivec2 first = ivec2(at.x, at.y % uRows) * uSamples;
    ivec2 end = min(first + uSamples + uMargin, uMapSize);
    first = max(first - uMargin, ivec2(0));
    float high = 0.0;
    float low = 1.0;
    for (int y = first.y; y < end.y; y++) {
        for (int x = first.x; x < end.x; x++) {
            float code = texelFetch(uMaps, ivec3(x, y, camera), 0).r;
            high = max(high, code);
            low = min(low, code);
        }
    }
    oBounds = vec2(high, low);
}
