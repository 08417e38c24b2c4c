#version 300 es
// A picture that is there already, its first row first.
precision highp float;
precision highp int;
precision highp sampler2D;

uniform sampler2D uPicture;
uniform ivec2 uSize;             // of the part of it that is drawn, px
uniform vec4 uArea;              // as in view.frag.glsl
uniform bool uFromTop;

out vec4 oColour;

void main() {
    vec2 drawn = (gl_FragCoord.xy - uArea.xy) / uArea.zw;
    ivec2 at = ivec2(vec2(drawn.x, uFromTop ? drawn.y : 1.0 - drawn.y) * vec2(uSize));
    oColour = vec4(texelFetch(uPicture, at, 0).rgb, 1.0);
}
