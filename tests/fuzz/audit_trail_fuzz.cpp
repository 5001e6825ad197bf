// Any head and two files of an audit trail, with a line "---" between them: refused in one line, or judged. A trail
// that is whole is a chain from its first line on; a program that goes on writing keeps a whole one whole, and hides
// nothing of a broken one.
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "app/audit/audit_files.h"
#include "app/audit/audit_trail.h"
#include "app/cli/digest.h"
#include "core/error.h"
#include "tests/fuzz/folder_in_memory.h"
#include "tests/fuzz/require.h"

namespace {

using namespace knuckle;

using knuckle::test::refused_or;
using knuckle::test::require;
using knuckle::test::require_line;

/// What a reader without any of the checker's code finds.
void check_chain(const audit::Check& check) {
  std::string before = audit::hash_before_all();
  std::uint64_t number = 0;
  for (const std::string& line : check.lines) {
    const auto json = nlohmann::json::parse(line);
    require(json.at("n") == ++number && json.at("before") == before);
    before = cli::sha256(line);
  }
  require(check.last.number == number && (number == 0 || check.last.hash == before));
}

audit::Check check(const std::string& folder) {
  audit::Check check = audit::check_trail(folder);
  for (const std::string& note : check.notes) require_line(note);
  for (const std::string& line : check.lines) require_line(audit::readable(line));
  if (check.broken().empty())
    check_chain(check);
  else
    require_line(check.broken());
  return check;
}

void check_and_go_on(const std::string& folder) {
  const audit::Check before = check(folder);
  try {
    audit::AuditTrail trail(folder);
    trail.note("connected", {{"name", "desk 1"}});
  } catch (const InputError& error) {
    require_line(error.what());
    require(!before.broken().empty());
    return;
  }
  const audit::Check after = check(folder);
  require(after.broken().empty() == before.broken().empty());
  if (after.broken().empty()) require(after.last.number > before.last.number);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::string_view kBetween = "---\n";
  static const test::FolderInMemory in_memory;
  std::string_view text(reinterpret_cast<const char*>(data), size);
  for (const char* file : {"head", "audit-000001.jsonl", "audit-000002.jsonl"}) {
    const std::size_t at = text.find(kBetween);
    in_memory.put(file, text.substr(0, at));
    text = at == std::string_view::npos ? std::string_view() : text.substr(at + kBetween.size());
  }
  refused_or([] { check_and_go_on(in_memory.path()); });
  return 0;
}
