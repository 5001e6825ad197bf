// What a C++ file defines for the linker to merge: types, functions and inline variables of named namespaces. Read from
// its tokens, not compiled: enough for this project's style, where macros define nothing.
#pragma once

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace knuckle::test {

/// Identifiers, numbers and single characters; no comments, preprocessor lines or literals' contents.
inline std::vector<std::string> tokens_of(std::string_view text) {
  std::vector<std::string> tokens;
  const auto word = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; };
  bool line_begins = true;
  std::size_t i = 0;
  const auto skip_past = [&](std::string_view end, std::size_t from) {
    const std::size_t found = text.find(end, from);
    i = found == std::string_view::npos ? text.size() : found + end.size();
  };
  while (i < text.size()) {
    const char c = text[i];
    if (std::isspace(static_cast<unsigned char>(c)) != 0) {
      line_begins = line_begins || c == '\n';
      ++i;
    } else if (text.substr(i, 2) == "//") {
      skip_past("\n", i);
      line_begins = true;
    } else if (text.substr(i, 2) == "/*") {
      skip_past("*/", i + 2);
    } else if (c == '#' && line_begins) {
      do skip_past("\n", i);
      while (i < text.size() && text[i - 1] == '\n' && text[i - 2] == '\\');
    } else {
      line_begins = false;
      if (text.substr(i, 2) == "R\"") {
        const std::size_t open = text.find('(', i);
        skip_past(")" + std::string(text.substr(i + 2, open - i - 2)) + "\"", open);
        tokens.emplace_back("\"");
      } else if (c == '"' || c == '\'') {
        for (++i; i < text.size() && text[i] != c; ++i) i += text[i] == '\\' ? 1u : 0u;
        ++i;
        tokens.emplace_back("\"");
      } else if (word(c)) {
        const bool number = std::isdigit(static_cast<unsigned char>(c)) != 0;
        const std::size_t begin = i;
        while (i < text.size() && (word(text[i]) || (number && text[i] == '\''))) ++i;
        tokens.emplace_back(text.substr(begin, i - begin));
      } else {
        tokens.emplace_back(1, c);
        ++i;
      }
    }
  }
  return tokens;
}

/// Reads the definitions of one file: name with namespaces; of functions also the parameters' types, so that overloads
/// differ.
class DefinitionReader {
 public:
  explicit DefinitionReader(std::string_view text) : tokens_(tokens_of(text)) { read_scope({}, true); }
  [[nodiscard]] const std::set<std::string>& found() const noexcept { return found_; }

 private:
  using Statement = std::vector<std::string>;

  static bool opens(const std::string& t) { return t == "(" || t == "[" || t == "{"; }
  static bool closes(const std::string& t) { return t == ")" || t == "]" || t == "}"; }
  static bool identifier(const std::string& t) {
    return std::isalpha(static_cast<unsigned char>(t[0])) != 0 || t[0] == '_';
  }
  static std::string joined(const Statement& s, std::size_t begin, std::size_t end) {
    std::string text;
    for (std::size_t i = begin; i < end; ++i) {
      if (!text.empty() && identifier(s[i]) && identifier(s[i - 1])) text += ' ';
      text += s[i];
    }
    return text;
  }
  /// Behind the bracket that closes the one at `i`.
  static std::size_t behind(const Statement& s, std::size_t i) {
    int depth = 0;
    do {
      depth += opens(s[i]) ? 1 : closes(s[i]) ? -1 : 0;
      ++i;
    } while (i < s.size() && depth > 0);
    return i;
  }
  /// Behind `<...>` at `i`, where there is one.
  static std::size_t behind_angles(const Statement& s, std::size_t i) {
    if (i >= s.size() || s[i] != "<") return i;
    int depth = 0;
    do {
      if (opens(s[i])) {
        i = behind(s, i);
        continue;
      }
      depth += s[i] == "<" ? 1 : s[i] == ">" ? -1 : 0;
      ++i;
    } while (i < s.size() && depth > 0);
    return i;
  }

  /// Until the scope's closing brace. @param merged whether the linker sees the names of this scope.
  void read_scope(const std::string& scope, bool merged) {
    Statement statement;
    bool noted = false;
    while (next_ < tokens_.size() && tokens_[next_] != "}") {
      const std::string& token = tokens_[next_];
      if (token == ";") {
        if (merged && !noted) note_variable(scope, statement);
        statement.clear();
        noted = false;
        ++next_;
      } else if (token == "(" || token == "[") {
        const std::size_t end = behind(tokens_, next_);
        statement.insert(statement.end(), tokens_.begin() + long(next_), tokens_.begin() + long(end));
        next_ = end;
      } else if (token != "{") {
        statement.push_back(token);
        ++next_;
      } else if (enter(scope, merged, statement)) {
        statement.clear();
      } else {
        const std::size_t end = behind(tokens_, next_);
        if (merged && !noted) note(scope, statement);
        noted = true;
        next_ = end;
        // Behind the value of a member or a variable its statement goes on; behind a body it does not.
        const std::string after = next_ < tokens_.size() ? tokens_[next_] : "";
        if (after != "," && after != "{" && after != ";") {
          statement.clear();
          noted = false;
        }
      }
    }
    ++next_;
  }

  /// Namespaces and extern "C" are read, all else in braces is passed over.
  bool enter(const std::string& scope, bool merged, const Statement& s) {
    const auto at = std::find(s.begin(), s.end(), "namespace");
    const bool named_scope = at != s.end() && at - s.begin() <= 1;
    const bool c_linkage = s.size() == 2 && s[0] == "extern";
    if (!named_scope && !c_linkage) return false;
    ++next_;
    if (c_linkage) {
      read_scope(scope, merged);
    } else {
      const std::string name = joined(s, std::size_t(at - s.begin()) + 1, s.size());
      read_scope(scope + name + "::", merged && !name.empty());
    }
    return true;
  }

  static std::size_t behind_template(const Statement& s) {
    std::size_t i = 0;
    while (i < s.size() && s[i] == "template") i = behind_angles(s, i + 1);
    return i;
  }

  void note(const std::string& scope, const Statement& s) {
    if (!note_type(scope, s) && !note_function(scope, s)) note_variable(scope, s);
  }

  bool note_type(const std::string& scope, const Statement& s) {
    static const std::set<std::string> kinds{"struct", "class", "union", "enum"};
    std::size_t i = behind_template(s);
    if (i >= s.size() || !kinds.contains(s[i])) return false;
    while (i < s.size() && (kinds.contains(s[i]) || s[i] == "[" || s[i] == "alignas"))
      i = s[i] == "[" ? behind(s, i) : s[i] == "alignas" ? behind(s, i + 1) : i + 1;
    std::size_t end = i;
    while (end < s.size() && s[end] != "final" && (s[end] != ":" || (end + 1 < s.size() && s[end + 1] == ":"))) {
      const bool double_colon = s[end] == ":";
      end = double_colon ? end + 2 : end + 1;
      end = behind_angles(s, end);
    }
    if (end > i) found_.insert(scope + joined(s, i, end));
    return true;
  }

  bool note_function(const std::string& scope, const Statement& s) {
    const std::size_t begin = behind_template(s);
    if (begin < s.size() && s[begin] == "static") return true;
    std::size_t open = begin;
    while (open < s.size() && s[open] != "(" && s[open] != "=") {
      if (s[open] == "[") {
        open = behind(s, open);
      } else if (s[open] == "<" && s[open - 1] != "operator" && s[open - 1] != "<") {
        open = behind_angles(s, open);
      } else {
        ++open;
      }
    }
    const auto is_operator = std::find(s.begin() + long(begin), s.begin() + long(open), "operator");
    if (open < s.size() && s[open] == "=" && is_operator != s.begin() + long(open))
      open = std::size_t(std::find(s.begin() + long(open), s.end(), "(") - s.begin());
    if (open >= s.size() || s[open] != "(" || open == begin) return false;
    std::size_t name = open;
    if (is_operator < s.begin() + long(open)) {
      name = std::size_t(is_operator - s.begin());
    } else {
      --name;
    }
    while (name >= begin + 3 && s[name - 1] == ":" && s[name - 2] == ":") name -= 3;
    found_.insert(scope + joined(s, name, open) + parameters(s, open));
    return true;
  }

  /// Types only: without names and default values.
  static std::string parameters(const Statement& s, std::size_t open) {
    const std::size_t end = behind(s, open) - 1;
    Statement types;
    int depth = 0;
    bool value = false;
    for (std::size_t i = open; i < end; ++i) {
      depth += s[i] == "<" || (opens(s[i]) && i > open) ? 1 : s[i] == ">" || closes(s[i]) ? -1 : 0;
      if (depth == 0 && s[i] == ",") value = false;
      if (depth == 0 && s[i] == "=") value = true;
      if (value) continue;
      const bool last = i + 1 == end || (depth == 0 && (s[i + 1] == "," || s[i + 1] == "="));
      const bool name = depth == 0 && last && identifier(s[i]) && i > open + 1 && s[i - 1] != "," && s[i - 1] != ":" &&
                        s[i - 1] != "const" && s[i - 1] != "unsigned";
      if (!name) types.push_back(s[i]);
    }
    return joined(types, 0, types.size()) + ")";
  }

  /// Only inline ones: others are their file's own, or the linker counts them.
  void note_variable(const std::string& scope, const Statement& s) {
    const std::size_t begin = behind_template(s);
    if (std::find(s.begin() + long(begin), s.end(), "inline") == s.end()) return;
    std::size_t end = begin;
    while (end < s.size() && s[end] != "=" && s[end] != "(") end = std::max(end + 1, behind_angles(s, end));
    if (end < s.size() && s[end] == "(") return;
    if (end > begin && identifier(s[end - 1])) found_.insert(scope + s[end - 1]);
  }

  std::vector<std::string> tokens_;
  std::size_t next_ = 0;
  std::set<std::string> found_;
};

[[nodiscard]] inline std::set<std::string> definitions_in(std::string_view text) {
  return DefinitionReader(text).found();
}

}  // namespace knuckle::test
