/* Kinematics and dynamics of a 7-axis arm for clients of version 5, which load this library and call it by name.
 *
 * The tables of the arm precede this text: JOINT_ROTATION, JOINT_POSITION (frame i + 1 in frame i at angle zero, the
 * last one the flange), MASS, CENTER, INERTIA (of the links, in the frames of their joints, about the centre of mass).
 *
 * Matrices of the interface are column-major, those in here row-major. All vectors of the dynamics are in base axes.
 */
#include <math.h>

#define JOINTS 7
#define FLANGE 8
#define EXPORT __attribute__((visibility("default")))

typedef struct {
  double R[9];
  double p[3];
} Frame;

static void rotate(const double R[9], const double v[3], double out[3]) {
  for (int i = 0; i < 3; i++) out[i] = R[3 * i] * v[0] + R[3 * i + 1] * v[1] + R[3 * i + 2] * v[2];
}

static void rotate_back(const double R[9], const double v[3], double out[3]) {
  for (int i = 0; i < 3; i++) out[i] = R[i] * v[0] + R[3 + i] * v[1] + R[6 + i] * v[2];
}

static void multiply(const double A[9], const double B[9], double out[9]) {
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) out[3 * i + j] = A[3 * i] * B[j] + A[3 * i + 1] * B[3 + j] + A[3 * i + 2] * B[6 + j];
}

static void cross(const double a[3], const double b[3], double out[3]) {
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}

static void place(const Frame *parent, const double R[9], const double p[3], Frame *out) {
  multiply(parent->R, R, out->R);
  rotate(parent->R, p, out->p);
  for (int i = 0; i < 3; i++) out->p[i] += parent->p[i];
}

/* Computes the frames of joints 1 to 7 and of the flange, in base: frames[0] to frames[7]. */
static void forward(const double q[JOINTS], Frame frames[FLANGE]) {
  Frame before = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}}, zero;
  for (int k = 0; k < FLANGE; k++) {
    place(&before, JOINT_ROTATION[k], JOINT_POSITION[k], &zero);
    frames[k] = zero;
    if (k < JOINTS) {
      const double c = cos(q[k]), s = sin(q[k]);
      const double turn[9] = {c, -s, 0, s, c, 0, 0, 0, 1};
      multiply(zero.R, turn, frames[k].R);
    }
    before = frames[k];
  }
}

static void end_effector(const Frame *flange, const double F_T_EE[16], Frame *out) {
  double R[9], p[3];
  for (int i = 0; i < 3; i++) {
    for (int j = 0; j < 3; j++) R[3 * i + j] = F_T_EE[4 * j + i];
    p[i] = F_T_EE[12 + i];
  }
  place(flange, R, p, out);
}

static void write_pose(const Frame *frame, double out[16]) {
  for (int j = 0; j < 3; j++) {
    for (int i = 0; i < 3; i++) out[4 * j + i] = frame->R[3 * i + j];
    out[4 * j + 3] = 0.0;
  }
  for (int i = 0; i < 3; i++) out[12 + i] = frame->p[i];
  out[15] = 1.0;
}

/* Writes the Jacobian of a frame that the first `count` joints move, in base axes or in those of the frame. */
static void write_jacobian(const Frame frames[FLANGE], int count, const Frame *at, int in_frame, double out[42]) {
  for (int k = 0; k < 42; k++) out[k] = 0.0;
  for (int k = 0; k < count; k++) {
    const double axis[3] = {frames[k].R[2], frames[k].R[5], frames[k].R[8]};
    double arm[3], velocity[3];
    for (int i = 0; i < 3; i++) arm[i] = at->p[i] - frames[k].p[i];
    cross(axis, arm, velocity);
    if (in_frame) {
      rotate_back(at->R, velocity, out + 6 * k);
      rotate_back(at->R, axis, out + 6 * k + 3);
    } else {
      for (int i = 0; i < 3; i++) {
        out[6 * k + i] = velocity[i];
        out[6 * k + 3 + i] = axis[i];
      }
    }
  }
}

static void pose_of(int number, const double q[JOINTS], double out[16]) {
  Frame frames[FLANGE];
  forward(q, frames);
  write_pose(&frames[number - 1], out);
}

static void jacobian_of(int number, const double q[JOINTS], int in_frame, double out[42]) {
  Frame frames[FLANGE];
  forward(q, frames);
  write_jacobian(frames, number < FLANGE ? number : JOINTS, &frames[number - 1], in_frame, out);
}

static void jacobian_of_end_effector(const double q[JOINTS], const double F_T_EE[16], int in_frame, double out[42]) {
  Frame frames[FLANGE], tool;
  forward(q, frames);
  end_effector(&frames[FLANGE - 1], F_T_EE, &tool);
  write_jacobian(frames, JOINTS, &tool, in_frame, out);
}

typedef struct {
  double mass;
  double center[3];
  double inertia[9];
} Body;

/* The motion of a frame: angular velocity and acceleration, acceleration of its origin less gravity. */
typedef struct {
  double w[3], dw[3], a[3];
} Motion;

/* Adds the force on a body, and its moment about the base's origin, that its motion requires. */
static void add_wrench(const Body *body, const Frame *frame, const Motion *motion, double force[3], double moment[3]) {
  double arm[3], turning[3], centripetal[3], tangential[3], f[3], I_axes[3], L[3], rate[3], spin[3], at[3];
  rotate(frame->R, body->center, arm);
  cross(motion->w, arm, turning);
  cross(motion->w, turning, centripetal);
  cross(motion->dw, arm, tangential);
  for (int i = 0; i < 3; i++) f[i] = body->mass * (motion->a[i] + tangential[i] + centripetal[i]);
  rotate_back(frame->R, motion->w, I_axes);
  rotate(body->inertia, I_axes, at);
  rotate(frame->R, at, L);
  rotate_back(frame->R, motion->dw, I_axes);
  rotate(body->inertia, I_axes, at);
  rotate(frame->R, at, rate);
  cross(motion->w, L, spin);
  for (int i = 0; i < 3; i++) arm[i] += frame->p[i];
  cross(arm, f, at);
  for (int i = 0; i < 3; i++) {
    force[i] += f[i];
    moment[i] += at[i] + rate[i] + spin[i];
  }
}

/* Computes the torques of a motion by Newton and Euler's recursion: outwards the motion, inwards force and moment. */
static void inverse_dynamics(const Frame frames[FLANGE], const double dq[JOINTS], const double ddq[JOINTS],
                             const double gravity[3], const Body *load, double tau[JOINTS]) {
  Motion motions[JOINTS], before = {{0, 0, 0}, {0, 0, 0}, {-gravity[0], -gravity[1], -gravity[2]}};
  double force[3] = {0, 0, 0}, moment[3] = {0, 0, 0}, origin[3] = {0, 0, 0};
  for (int k = 0; k < JOINTS; k++) {
    const double axis[3] = {frames[k].R[2], frames[k].R[5], frames[k].R[8]};
    double arm[3], turning[3], centripetal[3], tangential[3], gyroscopic[3];
    for (int i = 0; i < 3; i++) arm[i] = frames[k].p[i] - origin[i];
    cross(before.w, arm, turning);
    cross(before.w, turning, centripetal);
    cross(before.dw, arm, tangential);
    cross(before.w, axis, gyroscopic);
    for (int i = 0; i < 3; i++) {
      motions[k].a[i] = before.a[i] + tangential[i] + centripetal[i];
      motions[k].w[i] = before.w[i] + axis[i] * dq[k];
      motions[k].dw[i] = before.dw[i] + axis[i] * ddq[k] + gyroscopic[i] * dq[k];
      origin[i] = frames[k].p[i];
    }
    before = motions[k];
  }
  for (int k = JOINTS - 1; k >= 0; k--) {
    const double axis[3] = {frames[k].R[2], frames[k].R[5], frames[k].R[8]};
    Body link;
    double about_joint[3];
    if (k == JOINTS - 1) add_wrench(load, &frames[k], &motions[k], force, moment);
    link.mass = MASS[k];
    for (int i = 0; i < 3; i++) link.center[i] = CENTER[k][i];
    for (int i = 0; i < 9; i++) link.inertia[i] = INERTIA[k][i];
    add_wrench(&link, &frames[k], &motions[k], force, moment);
    cross(frames[k].p, force, about_joint);
    tau[k] = 0.0;
    for (int i = 0; i < 3; i++) tau[k] += axis[i] * (moment[i] - about_joint[i]);
  }
}

/* Returns a load of the flange in the frame of joint 7; `inertia` is symmetric. */
static Body load_at_joint(const double inertia[9], double mass, const double center[3]) {
  const double *R = JOINT_ROTATION[FLANGE - 1];
  double turned[9], back[9];
  Body load;
  load.mass = mass;
  rotate(R, center, load.center);
  for (int i = 0; i < 3; i++) load.center[i] += JOINT_POSITION[FLANGE - 1][i];
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) back[3 * i + j] = R[3 * j + i];
  multiply(R, inertia, turned);
  multiply(turned, back, load.inertia);
  return load;
}

static const double AT_ZERO[JOINTS] = {0};

EXPORT void O_T_J1(const double q[7], double out[16]) { pose_of(1, q, out); }
EXPORT void O_T_J2(const double q[7], double out[16]) { pose_of(2, q, out); }
EXPORT void O_T_J3(const double q[7], double out[16]) { pose_of(3, q, out); }
EXPORT void O_T_J4(const double q[7], double out[16]) { pose_of(4, q, out); }
EXPORT void O_T_J5(const double q[7], double out[16]) { pose_of(5, q, out); }
EXPORT void O_T_J6(const double q[7], double out[16]) { pose_of(6, q, out); }
EXPORT void O_T_J7(const double q[7], double out[16]) { pose_of(7, q, out); }
EXPORT void O_T_J8(const double q[7], double out[16]) { pose_of(8, q, out); }

EXPORT void O_T_J9(const double q[7], const double F_T_EE[16], double out[16]) {
  Frame frames[FLANGE], tool;
  forward(q, frames);
  end_effector(&frames[FLANGE - 1], F_T_EE, &tool);
  write_pose(&tool, out);
}

EXPORT void O_J_J1(double out[42]) { jacobian_of(1, AT_ZERO, 0, out); }
EXPORT void O_J_J2(const double q[7], double out[42]) { jacobian_of(2, q, 0, out); }
EXPORT void O_J_J3(const double q[7], double out[42]) { jacobian_of(3, q, 0, out); }
EXPORT void O_J_J4(const double q[7], double out[42]) { jacobian_of(4, q, 0, out); }
EXPORT void O_J_J5(const double q[7], double out[42]) { jacobian_of(5, q, 0, out); }
EXPORT void O_J_J6(const double q[7], double out[42]) { jacobian_of(6, q, 0, out); }
EXPORT void O_J_J7(const double q[7], double out[42]) { jacobian_of(7, q, 0, out); }
EXPORT void O_J_J8(const double q[7], double out[42]) { jacobian_of(8, q, 0, out); }
EXPORT void O_J_J9(const double q[7], const double F_T_EE[16], double out[42]) {
  jacobian_of_end_effector(q, F_T_EE, 0, out);
}

EXPORT void Ji_J_J1(double out[42]) { jacobian_of(1, AT_ZERO, 1, out); }
EXPORT void Ji_J_J2(const double q[7], double out[42]) { jacobian_of(2, q, 1, out); }
EXPORT void Ji_J_J3(const double q[7], double out[42]) { jacobian_of(3, q, 1, out); }
EXPORT void Ji_J_J4(const double q[7], double out[42]) { jacobian_of(4, q, 1, out); }
EXPORT void Ji_J_J5(const double q[7], double out[42]) { jacobian_of(5, q, 1, out); }
EXPORT void Ji_J_J6(const double q[7], double out[42]) { jacobian_of(6, q, 1, out); }
EXPORT void Ji_J_J7(const double q[7], double out[42]) { jacobian_of(7, q, 1, out); }
EXPORT void Ji_J_J8(const double q[7], double out[42]) { jacobian_of(8, q, 1, out); }
EXPORT void Ji_J_J9(const double q[7], const double F_T_EE[16], double out[42]) {
  jacobian_of_end_effector(q, F_T_EE, 1, out);
}

EXPORT void M_NE(const double q[7], const double I_load[9], double m_load, const double F_x_Cload[3], double out[49]) {
  const Body load = load_at_joint(I_load, m_load, F_x_Cload);
  const double weightless[3] = {0, 0, 0};
  Frame frames[FLANGE];
  forward(q, frames);
  for (int k = 0; k < JOINTS; k++) {
    double unit[JOINTS] = {0};
    unit[k] = 1.0;
    inverse_dynamics(frames, AT_ZERO, unit, weightless, &load, out + JOINTS * k);
  }
  for (int i = 0; i < JOINTS; i++)
    for (int j = 0; j < i; j++)
      out[JOINTS * i + j] = out[JOINTS * j + i] = 0.5 * (out[JOINTS * i + j] + out[JOINTS * j + i]);
}

EXPORT void c_NE(const double q[7], const double dq[7], const double I_load[9], double m_load,
                 const double F_x_Cload[3], double out[7]) {
  const Body load = load_at_joint(I_load, m_load, F_x_Cload);
  const double weightless[3] = {0, 0, 0};
  Frame frames[FLANGE];
  forward(q, frames);
  inverse_dynamics(frames, dq, AT_ZERO, weightless, &load, out);
}

EXPORT void g_NE(const double q[7], const double gravity[3], double m_load, const double F_x_Cload[3],
                 double out[7]) {
  const double no_inertia[9] = {0};
  const Body load = load_at_joint(no_inertia, m_load, F_x_Cload);
  Frame frames[FLANGE];
  forward(q, frames);
  inverse_dynamics(frames, AT_ZERO, AT_ZERO, gravity, &load, out);
}
