#include "app/report/csv_table.h"

#include <array>
#include <string_view>
#include <vector>

#include "app/recordings/state_table.h"
#include "app/session/record_windows.h"
#include "core/fields.h"

namespace knuckle::report {

void write_csv(const session::SessionRecord& record, std::ostream& out) {
  constexpr std::array<std::string_view, 1> kPhase{"phase"};  // by its name
  std::vector<Field> fields = fields_of<session::Sample>();
  std::erase_if(fields, [&](const Field& field) { return field.name == kPhase[0]; });
  recordings::StateTable table(out, fields, kPhase);
  for (const session::Sample& sample : record.samples) {
    const std::array<std::string_view, 1> phase{session::phase_name(record, sample)};
    table.add(&sample, phase);
  }
}

}  // namespace knuckle::report
