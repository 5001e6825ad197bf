#include "app/operators/plan.h"

#include <filesystem>
#include <set>

#include "machine/toml_reader.h"

namespace knuckle::operators {
namespace {

PlannedRecording read_recording(TomlTable& table, const std::filesystem::path& folder) {
  PlannedRecording recording;
  recording.file = (folder / table.text("file")).lexically_normal().string();
  recording.participant = table.text("participant");
  recording.input = table.text("input");
  recording.condition = table.text("condition");
  recording.task = table.text("task");
  if (table.has("tlx")) {
    TomlTable tlx = table.table("tlx");
    TaskLoad load{};
    for (std::size_t i = 0; i < load.size(); ++i) load[i] = tlx.number(kLoadScales[i], 0, 100);
    recording.load = load;
  }
  return recording;
}

}  // namespace

std::vector<PlannedRecording> load_plan(const std::string& path) {
  TomlTable plan = TomlTable::read(path);
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  std::vector<PlannedRecording> recordings;
  std::set<std::string> files;
  for (TomlTable& table : plan.tables("recording")) {
    recordings.push_back(read_recording(table, folder));
    table.require(files.insert(recordings.back().file).second, "file", "is listed before");
  }
  plan.require(!recordings.empty(), "recording", "at least one [[recording]] is needed");
  plan.finish();
  return recordings;
}

}  // namespace knuckle::operators
