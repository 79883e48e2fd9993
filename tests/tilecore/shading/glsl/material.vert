#version 450
layout(location = 0) in ivec4 in_place;
layout(location = 1) in vec2 in_weights;
layout(location = 2) in vec4 in_position;
layout(location = 0) flat out ivec4 place;
layout(location = 1) out vec2 weights;
void main() {
  place = in_place;
  weights = in_weights;
  gl_Position = in_position;
}
