#include "app/console/window/png_file.h"

#include <stb/stb_image_write.h>

#include "app/cli/output_file.h"

namespace knuckle::console::window {

void write_png_file(const std::string& path, int width, int height, std::span<const std::uint8_t> rgb) {
  cli::OutputFile file("--screenshot", path);
  stbi_flip_vertically_on_write(1);
  const auto write = [](void* stream, void* bytes, int size) {
    static_cast<std::ostream*>(stream)->write(static_cast<const char*>(bytes), size);
  };
  stbi_write_png_to_func(write, &file.stream(), width, height, 3, rgb.data(), width * 3);
  file.commit();
}

}  // namespace knuckle::console::window
