#version 300 es
// A picture on a screen that stands in space: two triangles.
uniform mat4 uProjection;
uniform mat4 uFromWorld;
uniform vec3 uMiddle;            // of the screen, m
uniform vec2 uExtent;            // its width and height, m

out vec2 vAt;                    // in shares of the picture, from its upper left

void main() {
    vAt = vec2(gl_VertexID & 1, gl_VertexID >> 1);
    vec2 place = (vAt - 0.5) * vec2(1.0, -1.0) * uExtent;
    gl_Position = uProjection * uFromWorld * vec4(uMiddle + vec3(place, 0.0), 1.0);
}
