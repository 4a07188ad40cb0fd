/* A robot that speaks DDS by Cyclone DDS, with messages encoded by code that its compiler made: it
   sends what `flatten` wrote at the speed of the recording, and writes down the poses that it gets.

   robot FLAT POSES [--domain N] [--scans N] [--seconds S] [--from S] [--speed F] [--shift S]
   [--reliable]

   At the end of the recording it drives back, and so on, until it has sent --scans scans or
   --seconds have passed; without both, it ends with the recording. Without an IMU and odometry it
   stands for a second before it turns back: no car goes from 50 km/h to -50 km/h in 0.1 s. --from
   begins that many seconds after the recording's beginning, --speed sends it that many times as
   fast (what an IMU measured is sent as it is), --shift moves all stamps.

   A line of POSES: stamp [s], x, y, z [m], qx, qy, qz, qw, delay from sending the scan [ms], and,
   if FLAT has the truth, the distance from it [m]; -1 where it is not known. The last line on
   standard output is JSON: how many were sent and received, delays, errors. */
#include <dds/dds.h>
#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "ros.h"

typedef geometry_msgs_msg_dds__PoseWithCovarianceStamped_ PoseMessage;

struct record {
  char kind;
  double stamp;
  uint32_t points;
  uint8_t timed;
  const float* values; /* of points */
  double sweep;        /* largest time of a point */
  double numbers[7];
};

static void fail(const char* what) {
  fprintf(stderr, "robot: %s\n", what);
  exit(1);
}

static dds_entity_t check(dds_entity_t entity, const char* what) {
  if (entity < 0) {
    fprintf(stderr, "robot: %s: %s\n", what, dds_strretcode(-entity));
    exit(1);
  }
  return entity;
}

static int64_t now(void) {
  struct timespec t;
  clock_gettime(CLOCK_REALTIME, &t);
  return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

/* When a record is sent, after the beginning of a pass [s]: a sweep at its end. */
static double pass_first, pass_last;
static bool pass_back;

static double due(const struct record* r) {
  return pass_back ? pass_last - r->stamp : r->stamp + r->sweep - pass_first;
}

static int by_due(const void* a, const void* b) {
  const double x = due(a), y = due(b);
  return x < y ? -1 : x > y;
}

static size_t read_records(const char* path, struct record** out) {
  FILE* file = fopen(path, "rb");
  if (!file) fail("cannot open the recording");
  size_t count = 0, room = 0;
  struct record* all = NULL;
  int kind;
  while ((kind = fgetc(file)) != EOF) {
    if (count == room) all = realloc(all, (room = room ? 2 * room : 1024) * sizeof *all);
    struct record* r = &all[count++];
    memset(r, 0, sizeof *r);
    r->kind = (char)kind;
    bool ok = fread(&r->stamp, sizeof r->stamp, 1, file) == 1;
    if (kind == 'P') {
      ok = ok && fread(&r->points, 4, 1, file) == 1 && fread(&r->timed, 1, 1, file) == 1;
      const size_t width = r->timed ? 4 : 3, size = r->points * width * sizeof(float);
      float* values = malloc(size ? size : 1);
      ok = ok && fread(values, 1, size, file) == size;
      for (uint32_t i = 0; r->timed && i < r->points; ++i) {
        if (values[i * 4 + 3] > r->sweep) r->sweep = values[i * 4 + 3];
      }
      r->values = values;
    } else {
      const size_t numbers = kind == 'I' ? 6 : 7; /* 'O' and 'T' are poses */
      ok = ok && fread(r->numbers, sizeof(double), numbers, file) == numbers;
    }
    if (!ok) fail("the recording ends early");
  }
  fclose(file);
  *out = all;
  return count;
}

static void set_time(builtin_interfaces_msg_dds__Time_* to, int64_t ns) {
  to->sec = (int32_t)(ns / 1000000000);
  to->nanosec = (uint32_t)(ns % 1000000000);
}

static void send_points(dds_entity_t writer, const struct record* r, int64_t stamp, bool back,
                        double speed) {
  static char* names[] = {"x", "y", "z", "time"};
  sensor_msgs_msg_dds__PointField_ fields[4];
  const uint32_t width = r->timed ? 4 : 3;
  for (uint32_t i = 0; i < width; ++i) {
    fields[i] = (sensor_msgs_msg_dds__PointField_){
        .name = names[i], .offset = 4 * i, .datatype = 7, .count = 1};
  }
  const uint32_t size = r->points * width * 4;
  float* turned = NULL;
  if (r->timed && (back || speed != 1.0)) {
    turned = malloc(size ? size : 1);
    memcpy(turned, r->values, size);
    for (uint32_t i = 0; i < r->points; ++i) {
      const float time = turned[i * 4 + 3];
      turned[i * 4 + 3] = (float)((back ? r->sweep - time : time) / speed);
    }
  }
  sensor_msgs_msg_dds__PointCloud2_ cloud = {
      .header = {.frame_id = "lidar"},
      .height = 1,
      .width = r->points,
      .fields = {._maximum = width, ._length = width, ._buffer = fields},
      .point_step = 4 * width,
      .row_step = size,
      .data = {._maximum = size,
               ._length = size,
               ._buffer = (uint8_t*)(turned ? turned : r->values)},
      .is_dense = true};
  set_time(&cloud.header.stamp, stamp);
  check(dds_write(writer, &cloud), "a scan could not be sent");
  free(turned);
}

static void send_imu(dds_entity_t writer, const struct record* r, int64_t stamp, bool back) {
  const double turn = back ? -1.0 : 1.0; /* accelerations are the same when time runs back */
  sensor_msgs_msg_dds__Imu_ imu = {
      .header = {.frame_id = "imu"},
      .orientation = {.w = 1.0},
      .orientation_covariance = {-1.0},
      .angular_velocity = {turn * r->numbers[0], turn * r->numbers[1], turn * r->numbers[2]},
      .linear_acceleration = {r->numbers[3], r->numbers[4], r->numbers[5]}};
  set_time(&imu.header.stamp, stamp);
  check(dds_write(writer, &imu), "a sample of the IMU could not be sent");
}

static void send_odometry(dds_entity_t writer, const struct record* r, int64_t stamp) {
  const double* x = r->numbers;
  nav_msgs_msg_dds__Odometry_ odometry = {
      .header = {.frame_id = "odom"},
      .child_frame_id = "base_link",
      .pose = {.pose = {.position = {x[0], x[1], x[2]}, .orientation = {x[3], x[4], x[5], x[6]}}}};
  set_time(&odometry.header.stamp, stamp);
  check(dds_write(writer, &odometry), "odometry could not be sent");
}

/* The truth, by the recording's time. */
static struct record* truth;
static size_t truths = 0;

/* Distance of `p` from where the robot was at `time` of the recording [m]; -1 if that is not known.
 */
static double distance(const geometry_msgs_msg_dds__Point_* p, double time) {
  size_t next = 0;
  while (next < truths && truth[next].stamp < time - 1e-6) ++next;
  if (next == truths) return -1.0;
  const double *b = truth[next].numbers, *a = next > 0 ? truth[next - 1].numbers : b;
  const double before = next > 0 ? truth[next - 1].stamp : truth[next].stamp - 1.0;
  const double t = fmin(fmax((time - before) / (truth[next].stamp - before), 0.0), 1.0);
  if (next == 0 && t < 1.0 - 1e-6) return -1.0;
  const double at[3] = {p->x, p->y, p->z};
  double sum = 0.0;
  for (int i = 0; i < 3; ++i) {
    const double d = at[i] - (a[i] + t * (b[i] - a[i]));
    sum += d * d;
  }
  return sqrt(sum);
}

#define REMEMBERED 4096
static struct {
  int64_t sent_at, stamp;
  double time;         /* of the recording [s] */
} scan_of[REMEMBERED]; /* the last scans, by their number */
static unsigned sent = 0, received = 0;
static double *delays, *errors; /* of the poses received [ms, m] */
static unsigned delay_count = 0, error_count = 0;
static double last_error = -1.0;

static void keep(double** list, unsigned* count, double value) {
  if (value < 0.0) return;
  if ((*count & (*count - 1)) == 0)
    *list = realloc(*list, (*count ? 2 * *count : 1) * sizeof value);
  (*list)[(*count)++] = value;
}

static void take_poses(dds_entity_t reader, FILE* out) {
  void* samples[16] = {NULL};
  dds_sample_info_t infos[16];
  int count;
  while ((count = dds_take(reader, samples, infos, 16, 16)) > 0) {
    const int64_t time = now();
    for (int i = 0; i < count; ++i) {
      if (!infos[i].valid_data) continue;
      const PoseMessage* m = samples[i];
      const int64_t stamp = (int64_t)m->header.stamp.sec * 1000000000 + m->header.stamp.nanosec;
      const geometry_msgs_msg_dds__Pose_* p = &m->pose.pose;
      double delay = -1.0, error = -1.0;
      for (unsigned k = 0; k < REMEMBERED && k < sent; ++k) {
        const unsigned at = (sent - 1 - k) % REMEMBERED;
        if (scan_of[at].stamp != stamp) continue;
        delay = (double)(time - scan_of[at].sent_at) * 1e-6;
        error = distance(&p->position, scan_of[at].time);
        break;
      }
      fprintf(out,
              "%" PRId64 ".%09" PRId64 " %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.3f %.4f\n",
              stamp / 1000000000, stamp % 1000000000, p->position.x, p->position.y, p->position.z,
              p->orientation.x, p->orientation.y, p->orientation.z, p->orientation.w, delay, error);
      ++received;
      keep(&delays, &delay_count, delay);
      keep(&errors, &error_count, error);
      if (error >= 0.0) last_error = error;
    }
    dds_return_loan(reader, samples, count);
  }
  fflush(out);
}

/* Writes down poses as they come, until `when`. */
static void take_until(int64_t when, dds_entity_t waitset, dds_entity_t reader, FILE* out) {
  do {
    const int64_t left = when - now();
    dds_attach_t ready;
    if (left > 0 && dds_waitset_wait(waitset, &ready, 1, left) < 0) fail("cannot wait");
    take_poses(reader, out);
  } while (now() < when);
}

static int by_size(const void* a, const void* b) {
  const double x = *(const double*)a, y = *(const double*)b;
  return x < y ? -1 : x > y;
}

static double quantile(const double* sorted, unsigned count, double share) {
  return count == 0 ? -1.0 : sorted[(unsigned)(share * (count - 1) + 0.5)];
}

static void print_json(void) {
  if (delay_count > 0) qsort(delays, delay_count, sizeof *delays, by_size);
  if (error_count > 0) qsort(errors, error_count, sizeof *errors, by_size);
  printf(
      "{\"sent\": %u, \"received\": %u, \"delay_ms\": {\"median\": %.2f, \"p99\": %.2f, \"max\": "
      "%.2f}, \"error_m\": {\"median\": %.4f, \"p99\": %.4f, \"max\": %.4f, \"last\": %.4f}}\n",
      sent, received, quantile(delays, delay_count, 0.5), quantile(delays, delay_count, 0.99),
      quantile(delays, delay_count, 1.0), quantile(errors, error_count, 0.5),
      quantile(errors, error_count, 0.99), quantile(errors, error_count, 1.0), last_error);
}

int main(int argc, char** argv) {
  if (argc < 3) fail("usage: robot FLAT POSES [OPTION...], see the top of its source");
  uint32_t domain = 0;
  unsigned scans = 0;
  double seconds = 0.0, from = 0.0, speed = 1.0, shift = 0.0;
  bool reliable = false;
  for (int i = 3; i < argc; ++i) {
    if (!strcmp(argv[i], "--reliable")) {
      reliable = true;
    } else if (!strcmp(argv[i], "--domain") && i + 1 < argc) {
      domain = (uint32_t)atoi(argv[++i]);
    } else if (!strcmp(argv[i], "--scans") && i + 1 < argc) {
      scans = (unsigned)atoi(argv[++i]);
    } else if (!strcmp(argv[i], "--seconds") && i + 1 < argc) {
      seconds = atof(argv[++i]);
    } else if (!strcmp(argv[i], "--from") && i + 1 < argc) {
      from = atof(argv[++i]);
    } else if (!strcmp(argv[i], "--speed") && i + 1 < argc) {
      speed = atof(argv[++i]);
    } else if (!strcmp(argv[i], "--shift") && i + 1 < argc) {
      shift = atof(argv[++i]);
    } else {
      fail("unknown option");
    }
  }
  struct record* all;
  size_t count = read_records(argv[1], &all);
  truth = malloc((count ? count : 1) * sizeof *truth);
  size_t messages = 0;
  const double first = count ? all[0].stamp + from : 0.0;
  for (size_t i = 0; i < count; ++i) {
    if (all[i].kind == 'T') {
      truth[truths++] = all[i];
    } else if (all[i].stamp >= first) {
      all[messages++] = all[i];
    }
  }
  count = messages;
  if (count == 0) fail("the recording is empty, or ends before --from");
  FILE* out = fopen(argv[2], "w");
  if (!out) fail("cannot write the poses");

  const dds_entity_t participant =
      check(dds_create_participant(domain, NULL, NULL), "no participant");
  dds_qos_t* qos = dds_create_qos();
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 1000);
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qos_t* point_qos = dds_create_qos();
  dds_qset_history(point_qos, DDS_HISTORY_KEEP_LAST, 5);
  dds_qset_reliability(point_qos, reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT,
                       DDS_SECS(1));
  dds_qos_t* latched = dds_create_qos();
  dds_copy_qos(latched, qos);
  dds_qset_durability(latched, DDS_DURABILITY_TRANSIENT_LOCAL);
#define TOPIC(type, name) \
  check(dds_create_topic(participant, &type##_desc, name, NULL, NULL), "no topic " name)
#define WRITER(type, name, q) \
  check(dds_create_writer(participant, TOPIC(type, name), q, NULL), "no writer of " name)
  const dds_entity_t points = WRITER(sensor_msgs_msg_dds__PointCloud2_, "rt/points", point_qos);
  const dds_entity_t imu = WRITER(sensor_msgs_msg_dds__Imu_, "rt/imu", qos);
  const dds_entity_t odometry = WRITER(nav_msgs_msg_dds__Odometry_, "rt/odom", qos);
  const dds_entity_t transforms = WRITER(tf2_msgs_msg_dds__TFMessage_, "rt/tf_static", latched);
  const dds_entity_t poses = check(
      dds_create_reader(participant,
                        TOPIC(geometry_msgs_msg_dds__PoseWithCovarianceStamped_, "rt/amcl_pose"),
                        latched, NULL),
      "no reader of rt/amcl_pose");
  const dds_entity_t waitset = check(dds_create_waitset(participant), "no waitset");
  const dds_entity_t available =
      check(dds_create_readcondition(poses, DDS_ANY_STATE), "no condition");
  check(dds_waitset_attach(waitset, available, available), "no waitset");

  geometry_msgs_msg_dds__TransformStamped_ mount = {.header = {.frame_id = "base_link"},
                                                    .child_frame_id = "lidar",
                                                    .transform = {.rotation = {.w = 1.0}}};
  tf2_msgs_msg_dds__TFMessage_ message = {
      .transforms = {._maximum = 1, ._length = 1, ._buffer = &mount}};
  check(dds_write(transforms, &message), "the mount could not be sent");

  for (int tries = 0;; ++tries) { /* until somebody listens and answers */
    dds_instance_handle_t reader, writer;
    if (dds_get_matched_subscriptions(points, &reader, 1) > 0 &&
        dds_get_matched_publications(poses, &writer, 1) > 0) {
      break;
    }
    if (tries == 3000) fail("nobody listens to rt/points");
    dds_sleepfor(DDS_MSECS(10));
  }
  dds_sleepfor(DDS_MSECS(200));

  pass_first = all[0].stamp;
  pass_last = all[count - 1].stamp;
  const int64_t begin = now();
  const int64_t end_at = seconds > 0.0 ? begin + (int64_t)(seconds * 1e9) : INT64_MAX;
  const bool again = scans > 0 || seconds > 0.0;
  double passed = 0.0; /* time of the passes before [s] */
  bool done = false, points_only = true;
  for (size_t i = 0; i < count; ++i) points_only = points_only && all[i].kind == 'P';
  for (pass_back = false; !done; pass_back = !pass_back) {
    qsort(all, count, sizeof *all, by_due);
    const size_t stands = points_only && again ? 10 : 0; /* scans */
    for (size_t k = 0; k < count + stands && !done; ++k) {
      const struct record* r = &all[k < count ? k : count - 1];
      const double end =
          passed + due(r) + (k < count ? 0.0 : 0.1 * speed * (double)(k - count + 1));
      const int64_t stamp = begin + (int64_t)(((end - r->sweep) / speed + shift) * 1e9);
      take_until(begin + (int64_t)(end / speed * 1e9), waitset, poses, out);
      if (r->kind == 'P') {
        const unsigned at = sent % REMEMBERED;
        scan_of[at].sent_at = now();
        scan_of[at].stamp = stamp;
        scan_of[at].time = r->stamp + (pass_back ? r->sweep : 0.0);
        ++sent;
        send_points(points, r, stamp, pass_back, speed);
      } else if (r->kind == 'I') {
        send_imu(imu, r, stamp, pass_back);
      } else {
        send_odometry(odometry, r, stamp);
      }
      done = (scans > 0 && sent == scans) || now() >= end_at;
    }
    if (!again) break;
    passed += pass_last - pass_first + 0.2 + 0.1 * speed * (double)stands;
  }
  take_until(now() + 1000000000, waitset, poses, out);
  printf("%u scans sent, %u poses received\n", sent, received);
  print_json();
  fclose(out);
  dds_delete(participant);
  return 0;
}
