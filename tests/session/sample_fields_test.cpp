// No number of a session's row is missing in its tables and digests.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "app/session/session_record.h"
#include "core/fields.h"

namespace knuckle::session {
namespace {

/// What the processor wants: of a plane's vectors (Eigen::Vector2d) 16 bytes, of a reason's code that of the reason.
std::size_t alignment_of(const Field& field) {
  if (field.type == NumberType::kUint16 && field.word != nullptr) return alignof(Reason);
  if (!field.vector) return field.size;
  return field.count == 2 ? alignof(PlanarVector) : alignof(double);
}

/// A member that no list visits leaves a gap that no padding explains.
TEST(SampleFields, CoverEveryByteOfEachStructButPadding) {
  const auto expect_covered = [](std::vector<Field> fields, std::size_t size) {
    std::sort(fields.begin(), fields.end(), [](const Field& a, const Field& b) { return a.offset < b.offset; });
    std::size_t end = fields.front().offset;
    for (const Field& field : fields) {
      EXPECT_LT(field.offset - end, alignment_of(field)) << "before " << field.name;
      end = field.offset + field.size;
    }
    EXPECT_LT(size - end, alignof(PlanarVector));
  };
  expect_covered(fields_of<slave::SlaveState>(), sizeof(slave::SlaveState));
  expect_covered(fields_of<master::MasterState>(), sizeof(master::MasterState));
  expect_covered(fields_of<Truth>(), sizeof(Truth));
  expect_covered(fields_of<Hand>(), sizeof(Hand));
}

}  // namespace
}  // namespace knuckle::session
