// Bytes of a text file as UTF-8, in whichever of the encodings that spreadsheets write.
#pragma once

#include <string>

namespace knuckle::recordings {

struct EncodedText {
  std::string utf8;      ///< Without a byte order mark.
  std::string encoding;  ///< That it was in: "UTF-8", "UTF-16", "Latin-1".
};

/// UTF-16 by its byte order mark, or by the zero bytes that text has in it; UTF-8 where it is that; else Latin-1.
[[nodiscard]] EncodedText to_utf8(std::string bytes);

}  // namespace knuckle::recordings
