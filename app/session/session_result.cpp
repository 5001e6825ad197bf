#include "app/session/session_result.h"

namespace knuckle::session {

Judged judge(const SessionResult& session) {
  Judged judged{session, compute_metrics(session.record), {}, false};
  judged.criteria = evaluate(session.criteria, judged.metrics);
  // A session whose record has gaps is not passed, whatever its criteria.
  if (session.record.records_lost > 0) {
    const auto holes = evaluate({{"records_lost", {}, 0}}, judged.metrics);
    judged.criteria.insert(judged.criteria.end(), holes.begin(), holes.end());
  }
  judged.passed = all_passed(judged.criteria);
  return judged;
}

}  // namespace knuckle::session
