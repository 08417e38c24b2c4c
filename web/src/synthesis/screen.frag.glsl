#version 300 es
// The part of a texture that holds a picture, its first row first.
precision highp float;
precision highp sampler2D;

uniform sampler2D uPicture;
uniform vec2 uFilled;            // px of the texture that hold the picture

in vec2 vAt;
out vec4 oColour;

void main() {
    vec2 at = clamp(vAt * uFilled, vec2(0.5), uFilled - 0.5);
    oColour = vec4(textureLod(uPicture, at / vec2(textureSize(uPicture, 0)), 0.0).rgb, 1.0);
}
