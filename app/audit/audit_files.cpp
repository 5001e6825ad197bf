#include "app/audit/audit_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "app/cli/digest.h"
#include "core/error.h"

namespace knuckle::audit {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr std::string_view kBegin = "audit-", kEnd = ".jsonl";
constexpr std::size_t kDigits = 6, kHashSize = 64;
constexpr int kDeepest = 16;  // arrays and objects inside each other; printing them recurses

std::optional<std::uint64_t> number_in(std::string_view text) {
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

std::string text_at(const Json& line, const char* key) {
  const auto found = line.find(key);
  return found != line.end() && found->is_string() ? found->get<std::string>() : "";
}
std::uint64_t number_at(const Json& line, const char* key) {
  const auto found = line.find(key);
  return found != line.end() && found->is_number_unsigned() ? found->get<std::uint64_t>() : 0;
}

/// Reading a pipe would wait for its writer. @throws InputError
void check_regular(const std::string& file) {
  std::error_code error;
  if (!fs::is_regular_file(fs::symlink_status(file, error)) || error) throw InputError(file + ": is no regular file");
}

/// From the last line back: a line that lacks no more than its line feed may itself look like a `resumed` one.
void mark_unfinished(std::vector<Line>& lines) {
  for (std::size_t at = lines.size(); at-- > 0;) {
    const auto& link = lines[at].link;
    if (!link || link->event != kResumedEvent) continue;
    std::size_t begin = at, size = 0;
    while (begin > 0 && size <= link->torn_bytes) size += lines[--begin].text.size() + 1;
    if (size != link->torn_bytes + 1) continue;
    std::string torn;
    for (std::size_t i = begin; i < at; ++i) torn += (i > begin ? "\n" : "") + lines[i].text;
    if (sha256(torn) != link->torn_sha256) continue;
    for (; begin < at; ++begin) lines[begin] = {std::move(lines[begin].text), std::nullopt, true};
  }
}

}  // namespace

std::string sha256(std::string_view bytes) {
  cli::Digest digest;
  digest.add(bytes);
  return digest.finish();
}

std::string hash_before_all() {
  return std::string(kHashSize, '0');
}

std::string file_of(const std::string& folder, std::uint64_t number) {
  return fmt::format("{}/{}{:06}{}", folder, kBegin, number, kEnd);
}

std::string head_file_of(const std::string& folder) {
  return folder + "/head";
}

std::vector<std::uint64_t> file_numbers(const std::string& folder) {
  std::error_code error;
  std::vector<std::uint64_t> numbers;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    const std::string name = entry->path().filename();
    if (name.size() < kBegin.size() + kDigits + kEnd.size() || !name.starts_with(kBegin) || !name.ends_with(kEnd))
      continue;
    const auto number =
        number_in(std::string_view(name).substr(kBegin.size(), name.size() - kBegin.size() - kEnd.size()));
    if (number) numbers.push_back(*number);
  }
  if (error) throw InputError(folder + ": cannot be read: " + error.message());
  std::sort(numbers.begin(), numbers.end());
  return numbers;
}

FileContent read_lines(const std::string& file) {
  check_regular(file);
  std::error_code error;
  const auto size = fs::file_size(file, error);
  if (error || size > kLargestFile_bytes)
    throw InputError(fmt::format("{}: is larger than {} MB", file, kLargestFile_bytes >> 20));
  std::ifstream in(file, std::ios::binary);
  const std::string all{std::istreambuf_iterator<char>(in), {}};
  if (!in && !in.eof()) throw InputError(file + ": cannot be read");
  FileContent content;
  std::size_t begin = 0;
  for (std::size_t end = all.find('\n'); end != std::string::npos; end = all.find('\n', begin)) {
    std::string text = all.substr(begin, end - begin);
    std::optional<Link> link = link_of(text);
    content.lines.push_back({std::move(text), std::move(link)});
    begin = end + 1;
  }
  content.rest = all.substr(begin);
  mark_unfinished(content.lines);
  return content;
}

std::optional<Link> link_of(const std::string& line) {
  bool too_deep = false;
  const auto look = [&](int depth, Json::parse_event_t, const Json&) {
    too_deep = too_deep || depth > kDeepest;
    return !too_deep;
  };
  const Json json = Json::parse(line, look, false);
  if (too_deep || !json.is_object()) return std::nullopt;
  Link link{number_at(json, "n"),        text_at(json, "before"),   text_at(json, "event"),
            number_at(json, "file"),     number_at(json, "oldest"), number_at(json, "torn_bytes"),
            text_at(json, "torn_sha256")};
  if (link.number == 0 || link.before.size() != kHashSize || link.event.empty()) return std::nullopt;
  return link;
}

std::string head_text(const Head& head) {
  return fmt::format("{:020} {}\n", head.number, head.hash);  // always of the same length: written in place
}

std::optional<Head> read_head(const std::string& folder) {
  std::error_code error;
  if (!fs::exists(fs::symlink_status(head_file_of(folder), error))) return std::nullopt;
  check_regular(head_file_of(folder));
  std::ifstream in(head_file_of(folder));
  std::string number, hash;
  if (!(in >> number >> hash) || hash.size() != kHashSize) return std::nullopt;
  const auto value = number_in(number);
  if (!value) return std::nullopt;
  return Head{*value, hash};
}

}  // namespace knuckle::audit
