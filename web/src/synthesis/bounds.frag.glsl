#version 300 es
// Largest of what falls into a tile, by blending: whatever the order, the result is the same.
precision highp float;

flat in vec4 vNear;
flat in vec4 vFar;
layout(location = 0) out vec4 oNear;
layout(location = 1) out vec4 oFar;

void main() {
    oNear = vNear;
    oFar = vFar;
}
