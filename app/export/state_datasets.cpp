#include "app/export/state_datasets.h"

#include <cstdint>
#include <vector>

#include "app/recordings/state_table.h"
#include "core/time.h"

namespace knuckle::exporting {
namespace {

std::vector<std::string> words_of(const Field& field) {
  std::vector<std::string> words;
  for (unsigned code = 0; code < field.words; ++code) words.emplace_back(field.word(code));
  return words;
}

std::string unit_of_field(const Field& field) {
  const bool of_reason = field.type == NumberType::kFloat;  // which unit, its code says
  const std::string unit = of_reason ? "" : unit_of(field.name);
  return unit.empty() && field.type == NumberType::kDouble ? "1" : unit;
}

}  // namespace

StateDatasets::StateDatasets(Hdf5File& file, const std::string& group, std::span<const Field> fields)
    : file_(file), fields_(fields) {
  first_ = file.add_dataset(group + "/time_s", NumberType::kDouble, 1);
  file.attribute(group + "/time_s", "unit", "s");
  for (const Field& field : fields_) {
    const std::string path = group + "/" + field.name;
    (void)file_.add_dataset(path, field.type, field.count);
    if (const std::string unit = unit_of_field(field); !unit.empty()) file_.attribute(path, "unit", unit);
    if (field.vector) file_.attribute(path, "columns", recordings::column_names(field));
    if (field.word != nullptr) file_.attribute(path, "words", words_of(field));
  }
}

void StateDatasets::add(const void* state) {
  std::size_t dataset = first_;
  const double time_s = to_seconds(Duration(static_cast<std::int64_t>(number_at(state, fields_.front()))));
  file_.add_row(dataset++, &time_s);
  for (const Field& field : fields_) file_.add_row(dataset++, static_cast<const std::byte*>(state) + field.offset);
}

}  // namespace knuckle::exporting
