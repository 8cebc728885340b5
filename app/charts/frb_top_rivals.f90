!> Rivals under torque, on the plain equations of a heavy top: the adaptive 8(5,3) of Dormand and Prince, and
!> Gragg's midpoint rule extrapolated in lanes.
module frb_top_rivals
    use frb_kinds, only: rk => wp
    implicit none
    private

    public :: dormand_prince_steps, midpoint_lanes, torques_of_midpoint

    integer, parameter :: lanes = 8                 !! sequences of the midpoint rule, and one idle lane
    integer, parameter :: torques_of_midpoint = 77  !! in a step: 4 + 6 + ... + 16, and one for each sequence

contains

    ! fpm does not see changes of included files: remove build/ after one.
    include 'rivals/dormand_prince.inc'

    include 'rivals/midpoint_lanes.inc'

    !> The right-hand side, y = (m, q), of a top whose force acts at e3; constants: 1/I and the force in
    !> space.
    pure subroutine rates(constants, y, dy)
        real(rk), intent(in) :: constants(6), y(7)
        real(rk), intent(out) :: dy(7)
        real(rk) :: w1, w2, w3, t1, t2, t3, u1, u2

        w1 = constants(1)*y(1)
        w2 = constants(2)*y(2)
        w3 = constants(3)*y(3)
        t1 = 2*(constants(5)*y(7) - constants(6)*y(6))
        t2 = 2*(constants(6)*y(5) - constants(4)*y(7))
        t3 = 2*(constants(4)*y(6) - constants(5)*y(5))
        u1 = constants(4) + y(4)*t1 + (t2*y(7) - t3*y(6))
        u2 = constants(5) + y(4)*t2 + (t3*y(5) - t1*y(7))
        dy(1) = y(2)*w3 - y(3)*w2 + u2
        dy(2) = y(3)*w1 - y(1)*w3 - u1
        dy(3) = y(1)*w2 - y(2)*w1
        w1 = 0.5_rk*w1
        w2 = 0.5_rk*w2
        w3 = 0.5_rk*w3
        dy(4) = -y(5)*w1 - y(6)*w2 - y(7)*w3
        dy(5) = y(4)*w1 + y(6)*w3 - y(7)*w2
        dy(6) = y(4)*w2 + y(7)*w1 - y(5)*w3
        dy(7) = y(4)*w3 + y(5)*w2 - y(6)*w1
    end subroutine rates

end module frb_top_rivals
