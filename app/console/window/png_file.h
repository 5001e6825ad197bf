// A picture into a PNG file.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace knuckle::console::window {

/// @param rgb three bytes a pixel, rows from the bottom up as OpenGL reads them.
/// @throws InputError where the file cannot be written.
void write_png_file(const std::string& path, int width, int height, std::span<const std::uint8_t> rgb);

}  // namespace knuckle::console::window
