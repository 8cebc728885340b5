!> A part of another program that is linked with the library into a shared object.
module frb_part
    use frb, only: wp, free_flow, rigid_body, status_ok
    use, intrinsic :: iso_c_binding, only: c_int
    implicit none
    private

    public :: turn_body

contains

    !> Moves a body for a time of one; 0 if the momentum keeps its norm and moves, at an attitude of norm one.
    integer(c_int) function turn_body() bind(c) result(wrong)
        type(rigid_body) :: body
        real(wp) :: m(3), q(4)
        integer :: stat

        m = [0.3_wp, 0.4_wp, 1.2_wp]
        q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
        body = rigid_body([0.6_wp, 0.8_wp, 1.0_wp])
        call free_flow(body, 1.0_wp, m, q, stat=stat)
        wrong = 1
        if (stat /= status_ok .or. abs(m(1) - 0.3_wp) < 0.01_wp) return
        if (max(abs(norm2(m) - 1.3_wp), abs(norm2(q) - 1)) < 1.0e-14_wp) wrong = 0
    end function turn_body

end module frb_part
