// A folder on the memory's file system, for readers that take one and look at the modes of what is in it.
#pragma once

#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

namespace knuckle::test {

class FolderInMemory {
 public:
  FolderInMemory() {
    std::string name = "/dev/shm/knuckle_fuzz_XXXXXX";
    if (mkdtemp(name.data()) == nullptr) std::abort();
    path_ = name;
  }
  ~FolderInMemory() { std::filesystem::remove_all(path_); }
  FolderInMemory(const FolderInMemory&) = delete;
  FolderInMemory& operator=(const FolderInMemory&) = delete;

  [[nodiscard]] const std::string& path() const { return path_; }
  /// Mode 0600, in place of what was there.
  void put(const std::string& name, std::string_view bytes) const {
    const std::string file = path_ + "/" + name;
    std::ofstream(file, std::ios::binary) << bytes;
    if (chmod(file.c_str(), 0600) != 0) std::abort();
  }

 private:
  std::string path_;
};

}  // namespace knuckle::test
