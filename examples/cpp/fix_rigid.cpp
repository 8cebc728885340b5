// Rigid molecules in the manner of an MD code: an array of structs that holds positions, attitudes and angular momenta
// in space, and a "fix" that a time step calls twice. The rotation between kicks is exact, however long the step.
//
// Here 1000 water-like dipoles turn in a uniform field, each on its own; their energy and their momentum about the
// field are conserved.

#include <frb.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

namespace {

struct Molecule {
    double x[3], v[3];
    double quat[4];     // scalar first, body to space
    double angmom[3];   // in space
    double torque[3];   // in space
};

// v turned by q (sign = 1, body to space) or by its inverse (sign = -1).
void rotate(const double q[4], double sign, const double v[3], double out[3])
{
    const double p[3] = {sign*q[1], sign*q[2], sign*q[3]};
    const double w[3] = {2*(p[1]*v[2] - p[2]*v[1]), 2*(p[2]*v[0] - p[0]*v[2]), 2*(p[0]*v[1] - p[1]*v[0])};
    const double u[3] = {p[1]*w[2] - p[2]*w[1], p[2]*w[0] - p[0]*w[2], p[0]*w[1] - p[1]*w[0]};
    for (int i = 0; i < 3; i++) out[i] = v[i] + q[0]*w[i] + u[i];
}

// Kick, exact drift, kick: the two halves of a step of velocity Verlet.
class FixRigid {
public:
    FixRigid(const double moments[3], double dt) : dt(dt)
    {
        const int status = frb_body_from_moments(moments, &body);
        if (status != FRB_OK) fail(status);
    }

    void initial_integrate(std::vector<Molecule> &molecules)
    {
        for (Molecule &molecule : molecules) {
            for (int i = 0; i < 3; i++) molecule.angmom[i] += 0.5*dt*molecule.torque[i];
            for (int i = 0; i < 3; i++) molecule.x[i] += dt*molecule.v[i];
            // The momentum in space does not change in the drift; the one in the body is scratch.
            double m[3];
            rotate(molecule.quat, -1, molecule.angmom, m);
            const int status = frb_flow(&body, dt, m, molecule.quat);
            if (status != FRB_OK) fail(status);
        }
    }

    void final_integrate(std::vector<Molecule> &molecules)
    {
        for (Molecule &molecule : molecules)
            for (int i = 0; i < 3; i++) molecule.angmom[i] += 0.5*dt*molecule.torque[i];
    }

    double kinetic_energy(const Molecule &molecule, const double moments[3]) const
    {
        double m[3];
        rotate(molecule.quat, -1, molecule.angmom, m);
        return 0.5*(m[0]*m[0]/moments[0] + m[1]*m[1]/moments[1] + m[2]*m[2]/moments[2]);
    }

private:
    [[noreturn]] static void fail(int status)
    {
        char text[100];
        frb_status_message(status, text, sizeof text);
        std::fprintf(stderr, "fix_rigid: %s\n", text);
        std::exit(1);
    }

    frb_body body;
    double dt;
};

const double field = 0.5;
const double dipole[3] = {0, 0, 1};     // in the body

// Torque d x E, and the energy -d . E.
double force(std::vector<Molecule> &molecules)
{
    double energy = 0;
    for (Molecule &molecule : molecules) {
        double d[3];
        rotate(molecule.quat, 1, dipole, d);
        molecule.torque[0] = d[1]*field;
        molecule.torque[1] = -d[0]*field;
        molecule.torque[2] = 0;
        energy -= field*d[2];
    }
    return energy;
}

}

int main()
{
    const double moments[3] = {1.0, 1.9, 2.9};
    const double dt = 0.02;
    const int steps = 500;
    std::vector<Molecule> molecules(1000);
    FixRigid fix(moments, dt);

    for (std::size_t i = 0; i < molecules.size(); i++) {
        Molecule &molecule = molecules[i];
        const double angle = 0.37*double(i);
        molecule = Molecule{};
        molecule.x[0] = double(i);
        molecule.quat[0] = std::cos(angle);
        molecule.quat[1] = std::sin(angle);
        for (int k = 0; k < 3; k++) molecule.angmom[k] = std::sin(1.0 + 2.3*double(i) + k);
    }
    double first = 0, about_field = 0, furthest = 0, moved = 0;
    for (int step = 0; step <= steps; step++) {
        if (step > 0) fix.initial_integrate(molecules);
        double energy = force(molecules);
        if (step > 0) fix.final_integrate(molecules);
        double momentum = 0;
        for (const Molecule &molecule : molecules) {
            energy += fix.kinetic_energy(molecule, moments);
            momentum += molecule.angmom[2];
        }
        if (step == 0) {
            first = energy;
            about_field = momentum;
        }
        furthest = std::fmax(furthest, std::fabs(energy/first - 1));
        moved = std::fmax(moved, std::fabs(momentum - about_field));
    }
    std::printf("energy of %zu molecules             %.6f\n", molecules.size(), first);
    std::printf("its largest relative error         %s 1e-4\n", furthest < 1e-4 ? "below" : "ABOVE");
    std::printf("momentum about the field is kept   %s 1e-12\n", moved < 1e-12*double(molecules.size()) ? "to" : "NOT TO");
    return furthest < 1e-4 && moved < 1e-12*double(molecules.size()) ? 0 : 1;
}
