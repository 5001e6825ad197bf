// Help for a terminal: lines broken between words, never inside a name.
#pragma once

#include <cstddef>
#include <string>

namespace knuckle::cli {

/// Lines longer than `width` go on below where their description begins: behind the first gap of two spaces or more.
/// A word that is longer than the room for it stays whole.
[[nodiscard]] std::string wrapped(const std::string& text, std::size_t width);

/// Of the terminal that standard output is; 0 where it is none.
[[nodiscard]] std::size_t terminal_width();

}  // namespace knuckle::cli
