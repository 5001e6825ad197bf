// Run by the build: writes the manual pages and the bash completion of `knuckle`, from the options of its commands.
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <string>

#include "app/cli/manual.h"
#include "app/knuckle_program.h"

namespace {

namespace fs = std::filesystem;

bool write(const fs::path& file, const std::string& text) {
  std::ofstream out(file, std::ios::binary);
  return static_cast<bool>(out << text << std::flush);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: knuckle-manuals SECTIONS_FOLDER OUTPUT_FOLDER\n";
    return 2;
  }
  const fs::path sections_folder = argv[1], folder = argv[2];
  const auto sections = [&sections_folder](const std::string& page) -> std::string {
    std::ifstream in(sections_folder / (page + ".roff"), std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  };
  const knuckle::cli::Program program = knuckle::knuckle_program();
  fs::create_directories(folder);
  bool written = write(folder / (program.name + ".bash"), knuckle::cli::bash_completion(program));
  for (const knuckle::cli::ManualPage& page : knuckle::cli::manual_pages(program, sections))
    written = write(folder / (page.name + ".1"), page.text) && written;
  if (!written) std::cerr << "knuckle-manuals: " << folder.string() << ": cannot be written\n";
  return written ? 0 : 2;
}
