// Owner of a file descriptor.
#pragma once

#include <unistd.h>

#include <cerrno>
#include <utility>

namespace knuckle {

/// Closes it at its end.
class Descriptor {
 public:
  Descriptor() noexcept = default;
  explicit Descriptor(int number) noexcept : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(other.release()) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    if (this == &other) return *this;
    (void)close();
    number_ = other.release();
    return *this;
  }
  ~Descriptor() { (void)close(); }

  [[nodiscard]] int get() const noexcept { return number_; }
  /// There is one: what it was made of did not fail.
  [[nodiscard]] explicit operator bool() const noexcept { return number_ >= 0; }
  /// Another one owns it from now on.
  [[nodiscard]] int release() noexcept { return std::exchange(number_, -1); }
  /// @return 0, or errno: a disk may refuse only now what was written. Otherwise errno stays as it is.
  int close() noexcept {
    if (number_ < 0) return 0;
    const int before = errno, refused = ::close(release()) == 0 ? 0 : errno;
    errno = before;
    return refused;
  }

 private:
  int number_ = -1;
};

}  // namespace knuckle
