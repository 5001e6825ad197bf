// SHA-256 of bytes, as sha256sum gives it.
#pragma once

#include <memory>
#include <string>
#include <string_view>

namespace knuckle::cli {

class Digest {
 public:
  Digest();
  ~Digest();
  Digest(const Digest&) = delete;
  Digest& operator=(const Digest&) = delete;

  void add(std::string_view bytes);
  /// However long it is. @throws InputError where it cannot be read.
  void add_file(const std::string& path);
  /// Hex of everything added so far; the digest is finished by it.
  [[nodiscard]] std::string finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Of one text.
[[nodiscard]] std::string sha256(std::string_view text);

}  // namespace knuckle::cli
