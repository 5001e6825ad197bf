#include "app/battery/rows.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <system_error>

#include "app/battery/quantity.h"
#include "app/cli/digest.h"
#include "app/cli/interrupt.h"
#include "app/session/session_result.h"
#include "core/error.h"
#include "machine/load.h"

namespace knuckle::battery {
Row run_cell(const Cell& cell) {
  Row row{{"cell", cell.index}, {"drawn", cell.drawn}, {"effects", cell.effects}};
  try {
    session::SessionHooks hooks;
    hooks.progress = [](double) { cli::check_interrupt(); };
    const session::SessionResult session = session::run_simulation(cell.options, hooks);
    const session::Judged judged = session::judge(session);
    for (const session::MetricEntry& entry : session::metric_table())
      row["metrics"][std::string(entry.name)] = metric((judged.metrics.*entry.member).value_or(std::nan("")));
    row["faults"] = Row::array();
    for (const session::FaultRecord& fault : session.record.faults) row["faults"].push_back(name(fault.reason.code));
    row["digest"] = session.digest.whole;
    row["failed"] = Row::array();
    for (const session::CriterionResult& criterion : judged.criteria) {
      if (criterion.missed() && decides(criterion.kind, session.requirements_decide))
        row["failed"].push_back(criterion.name);
    }
  } catch (const InputError& error) {
    row["refused"] = error.what();
  }
  return row;
}

Row run_cell(const Drawer& drawer, std::uint64_t index) {
  Cell cell;
  try {
    cell = drawer.cell(index);
  } catch (const InputError& error) {
    return {{"cell", index}, {"drawn", Row::object()}, {"refused", error.what()}};
  }
  return run_cell(cell);
}

std::optional<double> metric_of(const Row& row, std::string_view metric) {
  if (!was_run(row)) return std::nullopt;
  const auto found = row["metrics"].find(metric);
  if (found == row["metrics"].end() || !found->is_number()) return std::nullopt;
  return found->get<double>();
}

bool was_run(const Row& row) {
  return !row.contains("refused");
}

bool passed(const Row& row) {
  return was_run(row) && row["failed"].empty();
}

namespace {

constexpr const char* kSchema = "knuckle-battery-rows/1";

std::string contents(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  if (!stream) throw InputError(path + ": cannot be read");
  return {std::istreambuf_iterator<char>(stream), {}};
}

Row header(const RowsKey& key) {
  return {{"schema", kSchema}, {"settings", key.settings}, {"fingerprint", key.fingerprint}};
}

[[noreturn]] void refuse_foreign(const std::string& path) {
  throw InputError(path + ": is not a file of a battery's rows");
}

/// @throws InputError unless the first line is this battery's.
void check_header(const std::string& path, const std::string& line, const RowsKey& key) {
  const Row found = Row::parse(line, nullptr, false), expected = header(key);
  if (!found.is_object() || !found.contains("schema") || found["schema"] != expected["schema"] ||
      !found.contains("settings") || !found["settings"].is_object() || !found.contains("fingerprint"))
    refuse_foreign(path);
  for (const auto& [name, value] : expected["settings"].items()) {
    const Row& there = found["settings"];
    if (there.contains(name) && there[name] == value) continue;
    const std::string other = there.contains(name) ? there[name].dump() : "nothing";
    throw InputError(path + ": rows of another battery: " + name + " = " + other + ", not " + value.dump());
  }
  if (found["fingerprint"] != expected["fingerprint"])
    throw InputError(path + ": rows of another build, or of other machine, device or scenario files: use a new file");
}

bool is_row_of_a_session(const Row& row) {
  const auto is = [&row](const char* name, bool (Row::*type)() const noexcept) {
    return row.contains(name) && (row[name].*type)();
  };
  if (!is("drawn", &Row::is_object)) return false;
  if (is("refused", &Row::is_string)) return true;
  if (!is("metrics", &Row::is_object) || !is("faults", &Row::is_array) || !is("failed", &Row::is_array)) return false;
  const Row& metrics = row["metrics"];
  return is("digest", &Row::is_string) && std::all_of(metrics.begin(), metrics.end(), [](const Row& value) {
           return value.is_number() || value.is_null();
         });
}

bool is_cell(const Row& row, std::uint64_t cells) {
  return row.is_object() && row.contains("cell") && row["cell"].is_number_unsigned() &&
         row["cell"].get<std::uint64_t>() < cells;
}

/// @param whole set to the length of what is whole.
Rows parse(const std::string& path, const std::string& text, const RowsKey& key, std::size_t& whole) {
  Rows rows;
  whole = 0;
  int number = 1;
  for (std::size_t at = 0, end = 0; (end = text.find('\n', at)) != std::string::npos; at = end + 1, ++number) {
    const std::string line = text.substr(at, end - at);
    if (at == 0) {
      check_header(path, line, key);
    } else {
      const Row row = Row::parse(line, nullptr, false);
      if (!is_cell(row, key.cells) || !key.is_row(row))
        throw InputError(path + ":" + std::to_string(number) + ": is no row of this battery");
      const auto [there, added] = rows.emplace(row["cell"].get<std::uint64_t>(), row);
      if (!added && there->second != row)
        throw InputError(path + ":" + std::to_string(number) + ": differs from another row of the same cell");
    }
    whole = end + 1;
  }
  if (whole == 0 && !text.empty()) refuse_foreign(path);
  return rows;
}

}  // namespace

std::string fingerprint(const std::vector<std::string>& files) {
  cli::Digest digest;
  digest.add(contents("/proc/self/exe"));
  for (const std::string& file : files) digest.add(contents(file));
  return digest.finish();
}

RowsKey rows_key(const Settings& settings) {
  const std::string machine = find_config("machine", settings.machine);
  std::vector<std::string> files{machine, device_for(load_machine(machine), "").source};
  for (const CommissionedMachine& one : settings.commissioned) files.push_back(find_config("machine", one.file));
  for (const std::string& scenario : settings.scenarios) files.push_back(find_config("scenario", scenario));
  return {settings_json(settings), fingerprint(files), settings.sessions, is_row_of_a_session};
}

Rows read_rows(const std::string& path, const RowsKey& key) {
  std::size_t whole = 0;
  Rows rows = parse(path, contents(path), key, whole);
  if (whole == 0) refuse_foreign(path);
  return rows;
}

RowsFile::RowsFile(const std::string& path, const RowsKey& key) : path_(path) {
  std::error_code error;  // where its folder cannot be made, the file cannot either
  std::filesystem::create_directories(std::filesystem::path(path).parent_path(), error);
  descriptor_ = open(path.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC | O_NONBLOCK, 0666);
  if (descriptor_ < 0) fail(errno);
  try {
    struct stat is {};
    if (fstat(descriptor_, &is) != 0) fail(errno);
    if (!S_ISREG(is.st_mode)) throw InputError("--rows " + path + ": must be a file");
    // File systems of clusters may have no locks.
    if (flock(descriptor_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
      throw InputError("--rows " + path + ": another process is writing to it");
    std::size_t whole = 0;
    there_ = parse(path, contents(path), key, whole);
    // What a run that was ended in the midst of a write has left is no row.
    whole_ = static_cast<off_t>(whole);
    if (ftruncate(descriptor_, whole_) != 0) fail(errno);
    if (whole == 0) write(header(key).dump() + '\n');
  } catch (...) {
    close(descriptor_);
    throw;
  }
}

RowsFile::~RowsFile() {
  close(descriptor_);
}

void RowsFile::add(const Row& row) {
  const std::scoped_lock lock(writing_);
  if (!failed_) write(row.dump() + '\n');
}

void RowsFile::write(const std::string& line) {
  std::size_t written = 0;
  while (written < line.size()) {
    const ssize_t count = ::write(descriptor_, line.data() + written, line.size() - written);
    if (count < 0 && errno == EINTR) continue;
    if (count >= 0) {
      written += static_cast<std::size_t>(count);
      continue;
    }
    const int error = errno;
    failed_ = true;
    (void)!ftruncate(descriptor_, whole_);  // half a line would spoil the next one
    fail(error);
  }
  whole_ += static_cast<off_t>(line.size());
}

void RowsFile::fail(int error) const {
  throw InputError("--rows " + path_ + ": cannot be written: " + std::generic_category().message(error));
}

}  // namespace knuckle::battery
