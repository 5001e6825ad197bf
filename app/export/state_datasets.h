// The recorded states of one loop as datasets of a group in an HDF5 file: one for each field, a row a step.
#pragma once

#include <string>
#include <utility>

#include "app/export/hdf5_file.h"
#include "app/export/state_fields.h"

namespace knuckle::exporting {

/// Words of all codes, in their order.
template <typename Code>
[[nodiscard]] std::vector<std::string> words(Code last) {
  std::vector<std::string> all;
  for (unsigned i = 0; i <= static_cast<unsigned>(last); ++i) all.emplace_back(knuckle::name(static_cast<Code>(i)));
  return all;
}
[[nodiscard]] inline std::vector<std::string> words_of(Mode) {
  return words(Mode::kEStop);
}
[[nodiscard]] inline std::vector<std::string> words_of(ReasonCode) {
  return words(static_cast<ReasonCode>(static_cast<unsigned>(ReasonCode::kCount) - 1));
}

/// Fields are called as in the state's own list. Attributes: `unit`, where there is one ("1" of other doubles);
/// `columns` of vectors, their elements as in the CSV; `words` of modes and reasons, the word of code 0 first.
template <typename State>
class StateDatasets {
 public:
  /// Makes the datasets, and time_s beside them. @param group "/machine"
  StateDatasets(Hdf5File& file, const std::string& group) : file_(file) {
    first_ = file.add_dataset(group + "/time_s", NumberType::kDouble, 1);
    file.attribute(group + "/time_s", "unit", "s");
    for_each_field(State{}, [&](const char* name, const char* suffix, const auto& value) {
      add_dataset(group + "/" + name + suffix, name, suffix, value);
    });
  }

  void add(const State& state) {
    std::size_t dataset = first_;
    const double time_s = to_seconds(state.at);
    file_.add_row(dataset++, &time_s);
    for_each_field(state, [&](const char*, const char*, const auto& value) {
      if constexpr (recording::ScalarField<std::remove_cvref_t<decltype(value)>>) {
        const auto number = recording::number_of(value);
        file_.add_row(dataset++, &number);
      } else {
        file_.add_row(dataset++, value.data());
      }
    });
  }

 private:
  template <typename Value>
  void add_dataset(const std::string& path, const char* name, const char* suffix, const Value& value) {
    const std::string unit = *suffix == 0 ? unit_of(name) : "";
    if constexpr (!recording::ScalarField<Value>) {
      const auto width = static_cast<std::size_t>(value.size());
      (void)file_.add_dataset(path, NumberType::kDouble, width);
      file_.attribute(path, "unit", unit.empty() ? "1" : unit);
      file_.attribute(path, "columns", element_names(name, width, joints_of<State>(name)));
    } else {
      (void)file_.add_dataset(path, type_of<decltype(recording::number_of(value))>(), 1);
      if constexpr (std::is_enum_v<Value>) file_.attribute(path, "words", words_of(value));
      if (!unit.empty()) file_.attribute(path, "unit", unit);
      if (unit.empty() && std::is_same_v<Value, double>) file_.attribute(path, "unit", "1");
    }
  }

  Hdf5File& file_;
  std::size_t first_ = 0;  // the others follow it
};

}  // namespace knuckle::exporting
