!> Rivals: the exact motion with its attitude by a frame and the angle about the momentum, by van Zon and
!> Schofield.
module frb_momentum_frames
    use frb_agm, only: ellip_f, ellip_k, jacobi
    use frb_kinds, only: rk => wp
    use frb_rotations, only: matrix_to_quat, quat_product
    implicit none
    private

    public :: frame_steps

contains

    ! fpm does not see changes of included files: remove build/ after one.
    include 'rivals/frames.inc'

end module frb_momentum_frames
