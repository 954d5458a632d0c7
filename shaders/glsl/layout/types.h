// Names that make one struct text valid in C++ and in GLSL.
//
// GLSL reads every shared struct under `layout(scalar)`; C++ asserts each offset and size below its struct, and a test
// compares the offsets in the SPIR-V with C++. A buffer is passed by its device address: MOTE_ADDRESS(Name) is 8 bytes,
// a std::uint64_t in C++ and the buffer reference `Name` in GLSL (declared before with MOTE_BUFFER).
#ifndef MOTE_LAYOUT_TYPES_H
#define MOTE_LAYOUT_TYPES_H

#ifdef __cplusplus
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#define MOTE_ADDRESS(Buffer) std::uint64_t
#define MOTE_BUFFER(Buffer, Element)
#define MOTE_LAYOUT_BEGIN namespace mote::layout {
#define MOTE_LAYOUT_END }
#define MOTE_CONST inline constexpr
#define MOTE_ASSERT_OFFSET(Struct, field, bytes) static_assert(offsetof(Struct, field) == (bytes))
#define MOTE_ASSERT_SIZE(Struct, bytes) static_assert(sizeof(Struct) == (bytes))
namespace mote::layout {
using glm::vec2;
using glm::vec3;
using glm::vec4;
using glm::mat4;
using uint = std::uint32_t;
}  // namespace mote::layout
#else
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference2 : require
#define MOTE_ADDRESS(Buffer) Buffer
#define MOTE_BUFFER(Buffer, Element) \
  layout(buffer_reference, scalar, buffer_reference_align = 4) buffer Buffer { Element at[]; };
#define MOTE_LAYOUT_BEGIN
#define MOTE_LAYOUT_END
#define MOTE_CONST const
#define MOTE_ASSERT_OFFSET(Struct, field, bytes)
#define MOTE_ASSERT_SIZE(Struct, bytes)
#endif

MOTE_LAYOUT_BEGIN
MOTE_BUFFER(FloatBuffer, float)
MOTE_BUFFER(UintBuffer, uint)
MOTE_BUFFER(Vec4Buffer, vec4)
MOTE_LAYOUT_END

#endif
