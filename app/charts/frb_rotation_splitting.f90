!> A rival: the splitting into three rotations, orders 2 and 4.
module frb_rotation_splitting
    use frb_kinds, only: rk => wp
    implicit none
    private

    public :: rotation_steps

    ! fpm does not see changes of included files: remove build/ after one.
    include 'rivals/rotations.inc'

end module frb_rotation_splitting
