#include "core/descriptor.h"

#include <fcntl.h>
#include <gtest/gtest.h>

#include <cerrno>
#include <utility>

namespace knuckle {
namespace {

Descriptor opened() {
  return Descriptor(::open("/dev/null", O_RDONLY | O_CLOEXEC));
}
bool open(int number) {
  return ::fcntl(number, F_GETFD) >= 0;
}

TEST(Descriptor, IsClosedByItsLastOwnerOnce) {
  int number = -1;
  {
    Descriptor first = opened();
    number = first.get();
    Descriptor second(std::move(first));
    EXPECT_EQ(second.get(), number);
    Descriptor third = opened();
    const int replaced = third.get();
    third = std::move(second);
    EXPECT_FALSE(open(replaced));
    EXPECT_TRUE(open(number));
  }
  EXPECT_FALSE(open(number));
}

TEST(Descriptor, ReleasedItStaysOpen) {
  Descriptor descriptor = opened();
  const Descriptor other(descriptor.release());
  EXPECT_FALSE(descriptor);
  EXPECT_TRUE(open(other.get()));
}

TEST(Descriptor, ClosingTellsWhatWasRefusedAndLeavesErrno) {
  Descriptor none, wrong(1 << 20);
  errno = ENOENT;
  EXPECT_EQ(none.close(), 0);
  EXPECT_EQ(wrong.close(), EBADF);
  EXPECT_FALSE(wrong);
  EXPECT_EQ(errno, ENOENT);
}

}  // namespace
}  // namespace knuckle
